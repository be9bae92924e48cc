//! One-line texts for lists of evaluations.

use crate::commands::evaluation_text::status_text;
use faceoff_api::views::{day::DayView, evaluation::EvaluationView};

/// Formats an evaluation as one line.
pub(super) fn evaluation_line(evaluation: &EvaluationView) -> String {
    let (team, id) = (&evaluation.team_name, evaluation.id);
    format!("{team:<40} {id}  {}", status_text(evaluation))
}

/// Formats the evaluations that a day has started, one line each.
pub(super) fn evaluation_lines(day: &DayView) -> Vec<String> {
    day.evaluations.iter().map(evaluation_line).collect()
}
