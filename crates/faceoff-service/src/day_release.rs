//! Release of an evaluation day. All evaluations of a day run on the same episodes, so data about the episodes stays hidden
//! until the last evaluation of the day has ended; then it is released for everyone at once.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_store::Evaluation;

/// Refuses data about an evaluation's episodes while other evaluations of its day are pending or running.
///
/// # Errors
/// `NotYet`, with the number of those evaluations.
#[boxed_future]
pub async fn check_released(app: &AppState, evaluation: &Evaluation) -> Result<(), Problem> {
    if evaluation.released_at.is_some() {
        return Ok(());
    }
    let day = evaluation.stage_day.date;
    let day_evaluations = app.store.evaluations_of_day(evaluation.stage_day).await?;
    let under_way = day_evaluations
        .iter()
        .filter(|evaluation| !evaluation.state.is_over())
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
