//! What a server counts of itself, as Prometheus reads it (OpenMetrics text).
//!
//! Everything that works hands its numbers here: requests ([`Web`]), slots ([`Slots`]), what is told of changes
//! ([`Metrics::happened`]). What is a state and not a happening (the queue, disks) comes as a [`Standing`] when somebody
//! reads. Nothing here names a team, a person or a score: who may read the numbers learns how the server does, and of
//! nobody how they do. No clock is read and nothing is stored; counters begin at 0 with the process, as Prometheus expects.

mod latest;
mod slots;
mod standing;
mod web;

pub use slots::{Busy, Slots, UnitEnd};
pub use standing::{Disk, Process, Queue, Standing};
pub use web::Web;

use prometheus_client::{
    encoding::{EncodeLabelSet, text},
    metrics::{counter::Counter, family::Family, info::Info},
    registry::Registry,
};
use standing::Gauges;
use std::{fmt, sync::Arc};

/// The media type of [`Metrics::text`].
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// All numbers of a server; clones are the same ones.
#[derive(Clone)]
pub struct Metrics {
    registry: Arc<Registry>,
    web: Web,
    slots: Slots,
    events: Family<OfKind, Counter>,
    gauges: Gauges,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfKind {
    kind: String,
}

impl Metrics {
    /// Of a server of this version, from 0.
    #[must_use]
    pub fn new(version: &str) -> Self {
        let mut all = Registry::with_prefix("faceoff");
        all.register(
            "build",
            "Version of the server",
            Info::new([("version", version.to_owned())]),
        );
        let events = Family::default();
        all.register(
            "events",
            "Changes of the season that this process stored, by what happened",
            Family::clone(&events),
        );
        let web = Web::new(all.sub_registry_with_prefix("http"));
        let slots = Slots::new(&mut all);
        let gauges = Gauges::new(&mut all);
        Self {
            registry: Arc::new(all),
            web,
            slots,
            events,
            gauges,
        }
    }

    #[must_use]
    pub const fn web(&self) -> &Web {
        &self.web
    }

    /// Of slots, and of what they play.
    #[must_use]
    pub const fn slots(&self) -> &Slots {
        &self.slots
    }

    /// A change was stored; `kind` is what happened, as the log has it.
    pub fn happened(&self, kind: &str) {
        let kind = kind.to_owned();
        self.events.get_or_create(&OfKind { kind }).inc();
    }

    /// So many changes came faster than they could be told one by one.
    pub fn happened_untold(&self, count: u64) {
        let kind = "untold".to_owned();
        self.events.get_or_create(&OfKind { kind }).inc_by(count);
    }

    /// All numbers as text ([`MEDIA_TYPE`]), with how things stand now.
    ///
    /// # Errors
    /// If the library cannot write one of them down.
    pub fn text(&self, now: &Standing) -> Result<String, fmt::Error> {
        self.gauges.set(now);
        let mut text = String::new();
        text::encode(&mut text, &self.registry)?;
        Ok(text)
    }
}

impl fmt::Debug for Metrics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Metrics").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn what_happened_is_in_the_text() {
        let metrics = Metrics::new("1.2.3");
        metrics.happened("evaluation_finished");
        metrics.happened("evaluation_finished");
        let took = Duration::from_millis(3);
        metrics.web().answered("GET", Some("/board"), 200, took);
        metrics.web().answered("PUT", None, 404, took);
        let text = metrics.text(&Standing::default()).unwrap();
        for line in [
            "faceoff_build_info{version=\"1.2.3\"} 1",
            "faceoff_events_total{kind=\"evaluation_finished\"} 2",
            "faceoff_http_requests_total{method=\"GET\",route=\"/board\",status=\"200\"} 1",
            "faceoff_http_requests_total{method=\"PUT\",route=\"none\",status=\"404\"} 1",
            "faceoff_http_request_duration_seconds_bucket{le=\"0.005\",route=\"/board\"} 1",
            "faceoff_http_request_duration_seconds_bucket{le=\"0.0025\",route=\"/board\"} 0",
        ] {
            assert!(text.lines().any(|other| other == line), "{line} in\n{text}");
        }
        assert!(text.ends_with("# EOF\n"));
    }
}
