//! What a frozen board leaves out: one rule for boards, pages and comparisons.

use crate::{app::AppState, problem::Problem, views::evaluation::EvaluationView};
use faceoff_store::{EvaluationState, Ruling};
use faceoff_types::StageId;
use jiff::Timestamp;

/// The freeze of a stage's boards that hides what was finished at this time, if one does.
pub(crate) async fn hides(
    app: &AppState,
    stage: StageId,
    finished_at: Timestamp,
) -> Result<Option<Ruling>, Problem> {
    let frozen = app.store.boards_frozen(stage).await?;
    Ok(frozen.filter(|frozen| finished_at > frozen.at))
}

/// The same of an evaluation, which is not hidden before it is finished.
pub(crate) async fn hides_evaluation(
    app: &AppState,
    view: &EvaluationView,
) -> Result<Option<Ruling>, Problem> {
    match view.status.finished_at() {
        Some(at) => hides(app, view.stage, at).await,
        None => Ok(None),
    }
}

/// When an evaluation got its score, if it has one.
pub(crate) const fn scored_at(state: &EvaluationState) -> Option<Timestamp> {
    match state {
        EvaluationState::Finished { finished_at, .. } => Some(*finished_at),
        _ => None,
    }
}
