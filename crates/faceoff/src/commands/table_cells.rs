//! Cells that several tables have.

use crate::competition::competition;
use faceoff_types::{ComputationTimeSummary, ViolationCounts};
use std::fmt::Display;

/// Headings of the columns of [`violation_cells`].
pub(super) fn violation_headings() -> String {
    columns(competition().violations.iter().map(|info| &info.short))
}

/// The number of episodes (of a game: windows) with each kind of violation, as text.
pub(super) fn violation_cells(counts: &ViolationCounts) -> String {
    columns(
        competition()
            .violations
            .iter()
            .map(|info| counts.get(info.name)),
    )
}

fn columns(cells: impl Iterator<Item = impl Display>) -> String {
    let cells: Vec<String> = cells.map(|cell| format!("{cell:>4}")).collect();
    cells.join(" ")
}

/// An interval of rates between 0 and 1, in percent.
pub(super) fn percent_interval(rates: [f64; 2]) -> String {
    let [low, high] = rates.map(|rate| 100.0 * rate);
    format!("{low:.1} to {high:.1} %")
}

/// Mean, 99th percentile and maximum of computation times, in milliseconds, as text.
pub(super) fn computation_time_cell(time_s: ComputationTimeSummary) -> String {
    let [mean, p99, max] = [time_s.mean, time_s.p99, time_s.max].map(|seconds| 1e3 * seconds);
    format!("{mean:.2} / {p99:.2} / {max:.2}")
}
