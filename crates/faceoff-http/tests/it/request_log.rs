//! Tests of the log lines of requests.

use crate::site::*;
use serde_json::{Value, json};
use std::{
    io,
    sync::{Arc, Mutex},
};
use tracing::{Level, subscriber::DefaultGuard};
use tracing_subscriber::fmt::MakeWriter;

/// The log of this thread, on which the whole server of the test runs.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Log {
    /// Writes the thread's log lines down to `level` to this log, until the guard is dropped.
    fn capture(&self, level: Level) -> DefaultGuard {
        let subscriber = tracing_subscriber::fmt()
            .json()
            .with_max_level(level)
            .with_writer(self.clone());
        tracing::subscriber::set_default(subscriber.finish())
    }

    /// The log lines of answered requests.
    fn answers(&self) -> Vec<Value> {
        let text = String::from_utf8(self.0.lock().unwrap().clone()).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
        let is_answered = |line: &Value| line["fields"]["message"] == "answered";
        lines.filter(is_answered).collect()
    }
}

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl MakeWriter<'_> for Log {
    type Writer = Self;
    fn make_writer(&self) -> Self {
        self.clone()
    }
}

#[tokio::test]
async fn changes_are_logged_with_request_id_and_actor() {
    let log = Log::default();
    let _guard = log.capture(Level::INFO);
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let beta = json!({ "name": "Beta" });
    let forbidden = site.post("/api/v1/teams", Some(&team.token), &beta).await;
    forbidden.problem(403, "forbidden", &[]);
    site.get("/api/v1/board", None).await.json(200);
    site.get("/livez", None).await.json(200);
    // Reading requests are not logged at this level.
    let answers = log.answers();
    assert_eq!(answers.len(), 2, "{answers:#?}");
    let [created, refused] = [&answers[0], &answers[1]];
    assert_eq!(created["level"], "INFO");
    assert_eq!(created["fields"]["status"], 201);
    assert_eq!(created["span"]["method"], "POST");
    assert_eq!(created["span"]["path"], "/api/v1/teams");
    assert_eq!(created["span"]["actor"], "organiser");
    assert_eq!(refused["fields"]["status"], 403);
    assert_eq!(refused["span"]["id"], forbidden.header("x-request-id"));
    assert_eq!(refused["span"]["actor"], format!("team:{}", team.id));
}

#[tokio::test]
async fn reads_are_logged_at_debug_level() {
    let log = Log::default();
    let site = Site::start().await;
    let (team, _, evaluation) = site.team_with_evaluation("Alpha", "striker").await;
    let _guard = log.capture(Level::DEBUG);
    let found = site.get(&evaluation, Some(&team.token)).await;
    site.get("/readyz", None).await.json(200);
    // Probes are not logged.
    let answers = log.answers();
    assert_eq!(answers.len(), 1, "{answers:#?}");
    let span = &answers[0]["span"];
    assert_eq!(answers[0]["level"], "DEBUG");
    assert_eq!(span["evaluation"], found.json(200)["id"]);
    assert_eq!(span["actor"], format!("team:{}", team.id));
}
