//! What of a day stays inside until all of it comes out: one rule for API and pages.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_store::{Evaluation, EvaluationState};

/// Refuses what tells of an evaluation's episodes while others of its day are under way.
///
/// # Errors
/// `NotYet`, with how many.
#[boxed]
pub async fn check_released(app: &AppState, evaluation: &Evaluation) -> Result<(), Problem> {
    if evaluation.released_at.is_some() {
        return Ok(());
    }
    let day = evaluation.of.date;
    let of_day = app.store.evaluations_of_day(evaluation.of).await?;
    let is_open = |state: &EvaluationState| !state.is_over();
    let under_way = of_day.iter().filter(|other| is_open(&other.state)).count();
    Err(Problem::new(
        ProblemKind::NotYet,
        format!(
            "not yet: {under_way} evaluations of {day} are queued or running, on the same episodes; when \
             the last one has ended, all of the day comes out at once, whoever asks when"
        ),
    )
    .with("day", day.to_string())
    .with("under_way", under_way))
}
