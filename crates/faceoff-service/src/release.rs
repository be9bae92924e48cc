//! Release of a day: the one rule for API and pages of what stays hidden until then.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{Evaluation, EvaluationState};

/// Refuses data about an evaluation's episodes while other evaluations of its day are pending or running.
///
/// # Errors
/// `NotYet`, with the number of these.
#[boxed]
pub async fn check_released(app: &AppState, evaluation: &Evaluation) -> Result<(), Problem> {
    if evaluation.released_at.is_some() {
        return Ok(());
    }
    let day = evaluation.stage_day.date;
    let day_evaluations = app.store.evaluations_of_day(evaluation.stage_day).await?;
    let is_open = |state: &EvaluationState| !state.is_over();
    let under_way = day_evaluations
        .iter()
        .filter(|other| is_open(&other.state))
        .count();
    Err(Problem::new(
        ProblemKind::NotYet,
        format!(
            "not yet: {under_way} evaluations of {day} are queued or running on the same episodes; the whole day is \
             released when the last one has ended"
        ),
    )
    .with("day", day.to_string())
    .with("under_way", under_way))
}
