//! A phase of the measurement, in which a number of simulated workers run shards: its numbers as a table and as JSON.

use crate::simulated_worker::{Measurements, Retries};
use serde_json::{Value, json};
use std::{fmt::Write as _, time::Duration};

/// The measurements of a phase.
pub(crate) struct Phase {
    pub(crate) workers: usize,
    /// From the first request for a job to the last result stored in NATS.
    pub(crate) duration: Duration,
    pub(crate) measurements: Measurements,
}

impl Phase {
    pub(crate) fn shards(&self) -> usize {
        self.measurements.job_s.len()
    }

    pub(crate) fn shards_per_s(&self) -> f64 {
        self.shards() as f64 / self.duration.as_secs_f64()
    }

    /// The part of the workers' time in which they slept. Sleeping stands for running agents, so the rest is overhead.
    pub(crate) fn efficiency(&self) -> f64 {
        self.measurements.slept_s / (self.workers as f64 * self.duration.as_secs_f64())
    }

    /// A row of the table of all phases; latencies are medians in ms.
    pub(crate) fn line(&self) -> String {
        let [job, start, files, result] = self.series();
        format!(
            "| {} | {} | {:.1} | {:.2} | {:.4} | {} | {} | {} | {} |",
            self.workers,
            self.shards(),
            self.duration.as_secs_f64(),
            self.shards_per_s(),
            self.efficiency(),
            ms(quantile(&job, 0.5)),
            ms(quantile(&start, 0.5)),
            ms(quantile(&files, 0.5)),
            ms(quantile(&result, 0.5)),
        )
    }

    /// A table of the latencies.
    pub(crate) fn latencies(&self) -> String {
        let mut text = String::from("| ms | p50 | p95 | p99 | max |\n|---|---|---|---|---|\n");
        for (name, series) in SERIES.into_iter().zip(self.series()) {
            let cells = QUANTILES.map(|(_, share)| ms(quantile(&series, share)));
            // Writing to a string does not fail.
            let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
        }
        text
    }

    pub(crate) fn json(&self) -> Value {
        let mut latencies = json!({});
        for (name, series) in SERIES.into_iter().zip(self.series()) {
            for (label, share) in QUANTILES {
                latencies[name][label] = json!(quantile(&series, share));
            }
        }
        let Retries {
            jobs,
            renewals,
            files,
            results,
            lost,
        } = &self.measurements.retries;
        json!({
            "workers": self.workers,
            "shards": self.shards(),
            "took_s": self.duration.as_secs_f64(),
            "shards_per_s": self.shards_per_s(),
            "slept_s": self.measurements.slept_s,
            "efficiency": self.efficiency(),
            "latencies_s": latencies,
            "retries": { "jobs": jobs, "renewals": renewals, "files": files, "results": results, "lost": lost },
        })
    }

    /// The sorted latencies of [`SERIES`], in seconds.
    fn series(&self) -> [Vec<f64>; 4] {
        let measurements = &self.measurements;
        [
            &measurements.job_s,
            &measurements.start_s,
            &measurements.files_s,
            &measurements.result_s,
        ]
        .map(|series| {
            let mut sorted = series.clone();
            sorted.sort_by(f64::total_cmp);
            sorted
        })
    }
}

const SERIES: [&str; 4] = [
    "waiting for a job",
    "starting it",
    "files stored",
    "result sent",
];
const QUANTILES: [(&str, f64); 4] = [("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1.0)];

/// The smallest of the sorted numbers that is at least as large as this share of them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    let index = rank.saturating_sub(1);
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

fn ms(seconds: f64) -> String {
    format!("{:.1}", seconds * 1000.0)
}
