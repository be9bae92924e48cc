use crate::commands::evaluation_text::state;
use faceoff_api::views::evaluation::EvaluationView;

/// An evaluation in a line.
pub(super) fn line(evaluation: &EvaluationView) -> String {
    let (team, id) = (&evaluation.team_name, evaluation.id);
    format!("{team:<40} {id}  {}", state(evaluation))
}
