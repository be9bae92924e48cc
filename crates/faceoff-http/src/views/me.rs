//! How a team stands today.

use super::{
    day::NextCut,
    evaluation::EvaluationView,
    not_taken::NotTakenView,
    queue::QueueView,
    sight::Sight,
    stage,
    submission::{SubmissionStatus, SubmissionView},
    team::TeamView,
};
use crate::{app::AppState, problem::Problem, viewer::Viewer};
use faceoff_store::{Evaluation, EvaluationState, Team};
use faceoff_types::{EvaluationId, StageId, SubmissionId};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The calling team: who it is, what plays for it today and what it enters next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeView {
    /// Whose token the caller has.
    pub team: TeamView,
    /// Today's.
    pub turn: TurnView,
    /// What it enters at the next cut; null while it has no valid submission.
    pub active_submission: Option<SubmissionId>,
    /// The stages that are not over and do not take what is active: it does not play there, and why; absent without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_taken: Vec<NotTakenView>,
    /// What waits for its smoke run or is in it, the newest first.
    pub validating: Vec<ValidatingView>,
    /// When that cut is; null if none comes.
    pub next_cut: Option<NextCut>,
    /// Largest packed bundle that the server takes, in bytes.
    pub max_bundle_bytes: u64,
}

/// What plays for a team on a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TurnView {
    /// The stage that is open.
    pub stage: StageId,
    /// The date in its zone.
    pub day: Date,
    /// The evaluation that counts; null before the day's cut, if the team had nothing active then, and
    /// if it was cancelled, voided, not played in time or failed by our fault, and is not played again.
    pub evaluation: Option<EvaluationId>,
    /// Where that stands in the queue; absent if there is none, or it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueView>,
    /// What happens to it next; absent if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

/// A submission that has no verdict yet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ValidatingView {
    /// Which.
    pub submission: SubmissionId,
    /// Where its smoke run stands; null when it has just ended.
    pub queue: Option<QueueView>,
    /// What happens next.
    pub next: String,
}

impl MeView {
    pub(crate) async fn of(app: &AppState, team: Team) -> Result<Self, Problem> {
        let sight = Sight::of(app, Viewer::Team(team.id)).await?;
        let today = stage::current(app).await?.day(app.config.clock.now());
        let counts = |evaluation: &Evaluation| {
            let stopped = matches!(
                evaluation.state,
                EvaluationState::PlatformFailed { .. }
                    | EvaluationState::NotPlayed { .. }
                    | EvaluationState::Cancelled { .. }
            );
            !stopped && evaluation.voided.is_none()
        };
        let evaluations = app.store.evaluations_of(team.id).await?;
        let evaluation = evaluations
            .iter()
            .find(|evaluation| evaluation.of == today && counts(evaluation))
            .cloned();
        let evaluation = match evaluation {
            Some(evaluation) => Some(EvaluationView::of(app, &sight, evaluation).await?),
            None => None,
        };
        let submissions = SubmissionView::of_team(app, team.id).await?;
        let validating = submissions
            .iter()
            .filter(|submission| submission.status == SubmissionStatus::Validating)
            .map(|submission| ValidatingView {
                submission: submission.id,
                queue: submission.queue,
                next: submission.next.clone(),
            });
        let active = submissions.iter().find(|submission| submission.active);
        Ok(Self {
            team: team.into(),
            turn: TurnView {
                stage: today.stage,
                day: today.date,
                evaluation: evaluation.as_ref().map(|evaluation| evaluation.id),
                queue: evaluation.as_ref().and_then(|evaluation| evaluation.queue),
                next: evaluation.map(|evaluation| evaluation.next),
            },
            validating: validating.collect(),
            active_submission: active.map(|submission| submission.id),
            not_taken: active.map_or_else(Vec::new, |active| active.not_taken.clone()),
            next_cut: NextCut::first(app).await?,
            max_bundle_bytes: app.config.max_bundle_bytes,
        })
    }
}
