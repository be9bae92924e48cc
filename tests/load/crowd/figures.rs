//! Numbers of one phase, as a table and as JSON.

use crate::stub::{Tally, Trouble};
use serde_json::{Value, json};
use std::{fmt::Write as _, time::Duration};

/// Of so many workers, who slept for so long.
pub(crate) struct Phase {
    pub(crate) workers: usize,
    /// From the first request for work to the last outcome in NATS.
    pub(crate) took: Duration,
    pub(crate) tally: Tally,
}

impl Phase {
    pub(crate) fn shards(&self) -> usize {
        self.tally.order_s.len()
    }

    pub(crate) fn shards_per_s(&self) -> f64 {
        self.shards() as f64 / self.took.as_secs_f64()
    }

    /// The part of the workers' time in which they "played".
    pub(crate) fn efficiency(&self) -> f64 {
        self.tally.slept_s / (self.workers as f64 * self.took.as_secs_f64())
    }

    pub(crate) fn line(&self) -> String {
        let [order, begin, files, hand_in] = self.series();
        format!(
            "| {} | {} | {:.1} | {:.2} | {:.4} | {} | {} | {} | {} |",
            self.workers,
            self.shards(),
            self.took.as_secs_f64(),
            self.shards_per_s(),
            self.efficiency(),
            ms(quantile(&order, 0.5)),
            ms(quantile(&begin, 0.5)),
            ms(quantile(&files, 0.5)),
            ms(quantile(&hand_in, 0.5)),
        )
    }

    pub(crate) fn latencies(&self) -> String {
        let mut text = String::from("| ms | p50 | p95 | p99 | max |\n|---|---|---|---|---|\n");
        for (name, series) in SERIES.into_iter().zip(self.series()) {
            let cells = QUANTILES.map(|(_, of)| ms(quantile(&series, of)));
            // A string takes all that is written to it.
            let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
        }
        text
    }

    pub(crate) fn json(&self) -> Value {
        let mut latencies = json!({});
        for (name, series) in SERIES.into_iter().zip(self.series()) {
            for (of, share) in QUANTILES {
                latencies[name][of] = json!(quantile(&series, share));
            }
        }
        let Trouble {
            orders,
            renewals,
            files,
            outcomes,
            lost,
        } = &self.tally.trouble;
        json!({
            "workers": self.workers,
            "shards": self.shards(),
            "took_s": self.took.as_secs_f64(),
            "shards_per_s": self.shards_per_s(),
            "slept_s": self.tally.slept_s,
            "efficiency": self.efficiency(),
            "latencies_s": latencies,
            "tried_again": { "orders": orders, "renewals": renewals, "files": files, "outcomes": outcomes, "lost": lost },
        })
    }

    fn series(&self) -> [Vec<f64>; 4] {
        let tally = &self.tally;
        [
            &tally.order_s,
            &tally.begin_s,
            &tally.files_s,
            &tally.hand_in_s,
        ]
        .map(|series| {
            let mut sorted = series.clone();
            sorted.sort_by(f64::total_cmp);
            sorted
        })
    }
}

const SERIES: [&str; 4] = [
    "free to order",
    "order to begin",
    "files stored",
    "handed in",
];
const QUANTILES: [(&str, f64); 4] = [("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1.0)];

/// The smallest of sorted numbers that so large a share of them is not above.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    let at = rank.saturating_sub(1);
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

fn ms(seconds: f64) -> String {
    format!("{:.1}", seconds * 1000.0)
}
