//! Metrics of a server for Prometheus.
//!
//! Requests ([`RequestMetrics`]), jobs of slots ([`SlotMetrics`]) and events ([`Metrics::record_event`]) are counted as
//! they happen. The state of the queue, disks and the process is passed as [`GaugeValues`] when the metrics are read.
//! No metric names a team, a user or a score, so that operators learn nothing about teams from them. No clock is read
//! and nothing is stored; counters start at 0 with the process, as Prometheus expects.

mod declaration;
mod format;
mod gauges;
mod request_metrics;
mod slot_metrics;

pub use format::Format;
pub use gauges::{Disk, GaugeValues, Process, Queue};
pub use request_metrics::RequestMetrics;
pub use slot_metrics::{BusySlot, JobEnd, SlotMetrics};

use declaration::Declare;
use prometheus_client::{
    encoding::{EncodeLabelSet, text},
    metrics::{counter::Counter, family::Family, info::Info},
    registry::Registry,
};
use std::{fmt, sync::Arc};

/// Begins the name of every metric.
const PREFIX: &str = "faceoff";

/// All metrics of a server; clones share them.
#[derive(Clone)]
pub struct Metrics {
    registry: Arc<Registry>,
    /// Of HTTP requests.
    web: RequestMetrics,
    slots: SlotMetrics,
    events: Family<EventLabels, Counter>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct EventLabels {
    kind: String,
}

impl Metrics {
    /// Metrics of a server of this version; counters start at 0.
    #[must_use]
    pub fn new(version: &str) -> Self {
        let mut registry = Registry::with_prefix(PREFIX);
        registry.register(
            "build",
            "Version of the server",
            Info::new([("version", version.to_owned())]),
        );
        let events = registry.declare(
            "events",
            "Changes of the season that this process stored, by what happened",
        );
        let web = RequestMetrics::new(registry.sub_registry_with_prefix("http"));
        let slots = SlotMetrics::new(&mut registry);
        Self {
            registry: Arc::new(registry),
            web,
            slots,
            events,
        }
    }

    /// Metrics of HTTP requests.
    #[must_use]
    pub const fn web(&self) -> &RequestMetrics {
        &self.web
    }

    /// Metrics of slots, each of which runs one job at a time, and of their jobs.
    #[must_use]
    pub const fn slots(&self) -> &SlotMetrics {
        &self.slots
    }

    /// Counts a stored event; `kind` is its kind in the log.
    pub fn record_event(&self, kind: &str) {
        let kind = kind.to_owned();
        self.events.get_or_create(&EventLabels { kind }).inc();
    }

    /// Counts events that were missed because they came faster than they could be processed.
    pub fn record_missed_events(&self, count: u64) {
        // The label's value is part of the published metrics, and stays.
        let kind = "untold".to_owned();
        self.events
            .get_or_create(&EventLabels { kind })
            .inc_by(count);
    }

    /// All metrics as text in this format, with the current gauge values.
    ///
    /// # Errors
    /// If the library cannot format one of them.
    pub fn text(&self, format: Format, gauge_values: &GaugeValues) -> Result<String, fmt::Error> {
        let mut text = String::new();
        text::encode_registry(&mut text, &self.registry)?;
        text::encode_registry(&mut text, &gauges::registry(PREFIX, gauge_values))?;
        text::encode_eof(&mut text)?;
        Ok(format.convert(text))
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
    fn metrics_text_has_events_and_requests() {
        let metrics = Metrics::new("1.2.3");
        metrics.record_event("evaluation_finished");
        metrics.record_event("evaluation_finished");
        let duration = Duration::from_millis(3);
        metrics
            .web()
            .record_response("GET", Some("/board"), 200, duration);
        metrics.web().record_response("PUT", None, 404, duration);
        let text = metrics
            .text(Format::OpenMetrics, &GaugeValues::default())
            .unwrap();
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

    #[test]
    fn metrics_text_has_the_current_gauge_values() {
        let metrics = Metrics::new("1.2.3");
        let without_disks = metrics
            .text(Format::OpenMetrics, &GaugeValues::default())
            .unwrap();
        assert!(!without_disks.contains("disk_free"), "{without_disks}");
        let values = GaugeValues {
            database_writable: true,
            queue: Queue {
                running: 1,
                waiting: 2,
                out_of_space: 3,
                paused: true,
                oldest_wait_s: 1.5,
                expected_s: f64::NAN,
            },
            disks: vec![Disk {
                name: "data",
                free_bytes: 4,
                size_bytes: 5,
            }],
            process: Process {
                resident_bytes: 6,
                open_fds: 7,
                max_fds: u64::MAX,
            },
            ..GaugeValues::default()
        };
        let text = metrics.text(Format::OpenMetrics, &values).unwrap();
        for line in [
            "# HELP faceoff_queue_units Jobs: running, waiting, or waiting for disk space.",
            "# TYPE faceoff_queue_units gauge",
            "faceoff_queue_units{state=\"running\"} 1",
            "faceoff_queue_units{state=\"waiting\"} 2",
            "faceoff_queue_units{state=\"without_room\"} 3",
            "faceoff_queue_paused 1",
            "# UNIT faceoff_queue_oldest_wait_seconds seconds",
            "faceoff_queue_oldest_wait_seconds 1.5",
            "faceoff_queue_expected_seconds NaN",
            "faceoff_disk_free_bytes{disk=\"data\"} 4",
            "faceoff_disk_size_bytes{disk=\"data\"} 5",
            "faceoff_process_resident_memory_bytes 6",
            "faceoff_process_max_fds 9223372036854775807",
        ] {
            assert!(text.lines().any(|other| other == line), "{line} in\n{text}");
        }
    }
}
