//! How a team stands today.

use super::{day::NextCut, stage, team::TeamView};
use crate::{app::AppState, problem::Problem};
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
    /// When that is; null if none comes.
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
    /// if it was cancelled, voided or failed by our fault and is not played again.
    pub evaluation: Option<EvaluationId>,
}

impl MeView {
    pub(crate) async fn of(app: &AppState, team: Team) -> Result<Self, Problem> {
        let today = stage::current(app).await?.day(app.config.clock.now());
        let counts = |evaluation: &Evaluation| {
            let stopped = matches!(
                evaluation.state,
                EvaluationState::PlatformFailed { .. } | EvaluationState::Cancelled { .. }
            );
            !stopped && evaluation.voided.is_none()
        };
        let evaluations = app.store.evaluations_of(team.id).await?;
        let evaluation = evaluations
            .iter()
            .find(|evaluation| evaluation.of == today && counts(evaluation))
            .map(|evaluation| evaluation.id);
        let submissions = app.store.submissions_of(team.id).await?;
        let active = submissions.iter().find(|submission| submission.active);
        Ok(Self {
            team: team.into(),
            turn: TurnView {
                stage: today.stage,
                day: today.date,
                evaluation,
            },
            active_submission: active.map(|submission| submission.id),
            next_cut: NextCut::first(app).await?,
            max_bundle_bytes: app.config.max_bundle_bytes,
        })
    }
}
