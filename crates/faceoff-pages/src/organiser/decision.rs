//! Decisions of organisers: a preview of the effects, and the execution.

mod day;
mod evaluation;
mod preview;
mod queue;
mod stage;
mod team;
mod worker;

use day::DayDecision;
use evaluation::EvaluationDecision;
use faceoff_api::requests;
use faceoff_service::{app::AppState, problem::Problem};
use faceoff_store::Actor;
pub(super) use preview::DecisionPreview;
use queue::QueueDecision;
use stage::StageDecision;
use std::{fmt, str::FromStr};
use team::TeamDecision;
use worker::WorkerDecision;

/// A decision, parsed from the path of its page.
#[derive(Debug, Clone)]
pub(super) enum Decision {
    Day(DayDecision),
    Queue(QueueDecision),
    Evaluation(EvaluationDecision),
    Team(TeamDecision),
    Stage(StageDecision),
    Worker(WorkerDecision),
}

#[derive(Debug)]
pub(super) struct UnknownDecision;

impl fmt::Display for UnknownDecision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("unknown decision; go back to the dashboard and choose one there")
    }
}

impl FromStr for Decision {
    type Err = UnknownDecision;

    fn from_str(path: &str) -> Result<Self, UnknownDecision> {
        let (kind, subject) = path.split_once('/').unwrap_or((path, ""));
        let found = DayDecision::from_path(kind, subject).map(Self::Day);
        found
            .or_else(|| QueueDecision::from_path(kind, subject).map(Self::Queue))
            .or_else(|| EvaluationDecision::from_path(kind, subject).map(Self::Evaluation))
            .or_else(|| TeamDecision::from_path(kind, subject).map(Self::Team))
            .or_else(|| StageDecision::from_path(kind, subject).map(Self::Stage))
            .or_else(|| WorkerDecision::from_path(kind, subject).map(Self::Worker))
            .ok_or(UnknownDecision)
    }
}

impl Decision {
    pub(super) async fn preview(&self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Day(decision) => decision.preview(app).await,
            Self::Queue(decision) => decision.preview(app).await,
            Self::Evaluation(decision) => decision.preview(app).await,
            Self::Team(decision) => decision.preview(app).await,
            Self::Stage(decision) => decision.preview(app).await,
            Self::Worker(decision) => Ok(decision.preview()),
        }
    }

    /// Executes the decision like the API. Returns the key of the notice.
    pub(super) async fn carry_out(
        &self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<&'static str, Problem> {
        match self {
            Self::Day(decision) => decision.carry_out(app, actor, request).await,
            Self::Queue(decision) => decision.carry_out(app, actor, request).await,
            Self::Evaluation(decision) => decision.carry_out(app, actor, request).await,
            Self::Team(decision) => decision.carry_out(app, actor, request).await,
            Self::Stage(decision) => decision.carry_out(app, actor, request).await,
            Self::Worker(decision) => decision.carry_out(app, actor, request).await,
        }
    }
}
