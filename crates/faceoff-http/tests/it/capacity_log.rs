//! Tests of the log's warnings about evaluation days that will not finish before their deadline.

use crate::{capacity::run_evaluation_slowly, site::Site};
use serde_json::json;
use std::{
    fmt::{Debug, Write as _},
    sync::{Arc, Mutex},
};
use tracing::{
    Event, Level, Metadata, Subscriber,
    field::{Field, Visit},
    span::{Attributes, Id, Record},
};

/// The warnings that this thread logs, one text each.
#[derive(Clone, Default)]
struct Warnings(Arc<Mutex<Vec<String>>>);

impl Warnings {
    fn capacity_warnings(&self) -> Vec<String> {
        let lines = self.0.lock().unwrap();
        let matching = lines.iter().filter(|line| line.contains("does not fit"));
        matching.cloned().collect()
    }

    async fn wait_for(&self, count: usize) {
        while self.capacity_warnings().len() < count {
            tokio::task::yield_now().await;
        }
    }
}

/// Appends the fields of a log event to a text.
struct FieldWriter<'a>(&'a mut String);

impl Visit for FieldWriter<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        write!(self.0, "{}={value:?} ", field.name()).unwrap();
    }
}

impl Subscriber for Warnings {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::WARN
    }
    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }
    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn event(&self, event: &Event<'_>) {
        let mut text = String::new();
        event.record(&mut FieldWriter(&mut text));
        self.0.lock().unwrap().push(text);
    }
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

#[tokio::test]
async fn overfull_day_is_logged_once_and_again_at_its_cutoff() {
    let site = Site::start_with_schedule("12:00").await;
    let alpha = site.team("Alpha").await;
    let stage = site.stage().await.to_string();
    let submission = site.valid_submission(&alpha, "a").await;
    site.start_evaluation(&alpha, &submission).await;
    run_evaluation_slowly(&site, 300).await;
    site.next_day();
    let rules = json!({ "episodes_per_task": 1000, "day_deadline": { "hours": 1 }, "confirm": "Qualifying" });
    site.change_stage(&stage, rules).await.json(200);

    let warnings = Warnings::default();
    let _guard = tracing::subscriber::set_default(warnings.clone());
    let (shutdown_sender, shutdown_receiver) = tokio::sync::oneshot::channel::<()>();
    let shutdown = async {
        let _ = shutdown_receiver.await;
    };
    let monitor = tokio::spawn(site.capacity_monitor().run(shutdown));
    warnings.wait_for(1).await;
    // The cutoff triggers a check: it warns of the started day and of the next one.
    site.start_evaluation(&alpha, &submission).await;
    warnings.wait_for(3).await;
    drop(shutdown_sender);
    monitor.await.unwrap();
    let lines = warnings.capacity_warnings();
    assert_eq!(lines.len(), 3, "{lines:#?}");
    for (line, day) in lines.iter().zip(["2026-03-02", "2026-03-02", "2026-03-03"]) {
        for part in ["stage=Qualifying", &format!("day={day}"), "More slots"] {
            assert!(line.contains(part), "{part:?} is not in {line}");
        }
    }
    assert!(lines[0].contains("1 team will have 3000"), "{}", lines[0]);
    assert!(lines[1].contains("1 team has 3000"), "{}", lines[1]);
}
