//! Columns with positions on the table in the download of episodes. They exist only in the world of air hockey.

use faceoff_replay::{EpisodeIndexEntry, ViolationSummary};
use faceoff_service::csv::or_empty;

/// Ends of the names of the columns that each kind of violation has.
pub(super) const VIOLATION_SUFFIXES: [&str; 3] = ["x_m", "y_m", "joint"];

/// Columns of the puck's state at the start and at the end.
pub(super) fn state_columns() -> impl Iterator<Item = String> {
    let values = ["x_m", "y_m", "vx_m_s", "vy_m_s"];
    let states = ["start", "last"].into_iter();
    states.flat_map(move |state| values.map(|value| format!("{state}_{value}")))
}

/// The cells of [`state_columns`].
pub(super) fn states(summary: &EpisodeIndexEntry) -> impl Iterator<Item = String> {
    let states = [summary.puck_at_start, summary.puck_at_end].into_iter();
    let numbers = states.flat_map(|state| state.map_or([None; 4], |state| state.map(Some)));
    numbers.map(or_empty)
}

/// The cells of [`VIOLATION_SUFFIXES`].
pub(super) fn violation(violation: Option<&ViolationSummary>) -> [String; 3] {
    let at = violation.and_then(|violation| violation.at);
    [
        or_empty(at.map(|[x, _]| x)),
        or_empty(at.map(|[_, y]| y)),
        or_empty(violation.and_then(|violation| violation.joint)),
    ]
}
