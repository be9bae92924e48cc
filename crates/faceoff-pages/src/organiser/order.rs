//! What an organiser may decide: what each decision would do, in words, and how it is carried out.

mod day;
mod queue;
mod sheet;
mod stage;
mod team;
mod turn;
mod worker;

use day::DayOrder;
use faceoff_api::requests::Decision;
use faceoff_service::{app::AppState, problem::Problem};
use faceoff_store::Actor;
use queue::QueueOrder;
pub(super) use sheet::Sheet;
use stage::StageOrder;
use std::{fmt, str::FromStr};
use team::TeamOrder;
use turn::TurnOrder;
use worker::WorkerOrder;

/// A decision, as its page's path names it.
#[derive(Debug, Clone)]
pub(super) enum Order {
    Day(DayOrder),
    Queue(QueueOrder),
    Turn(TurnOrder),
    Team(TeamOrder),
    Stage(StageOrder),
    Worker(WorkerOrder),
}

/// A path that names no decision.
#[derive(Debug)]
pub(super) struct NoOrder;

impl fmt::Display for NoOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("there is no such decision; go back to the desk, and choose one there")
    }
}

impl FromStr for Order {
    type Err = NoOrder;

    fn from_str(path: &str) -> Result<Self, NoOrder> {
        let (kind, of) = path.split_once('/').unwrap_or((path, ""));
        let found = DayOrder::named(kind, of).map(Self::Day);
        found
            .or_else(|| QueueOrder::named(kind, of).map(Self::Queue))
            .or_else(|| TurnOrder::named(kind, of).map(Self::Turn))
            .or_else(|| TeamOrder::named(kind, of).map(Self::Team))
            .or_else(|| StageOrder::named(kind, of).map(Self::Stage))
            .or_else(|| WorkerOrder::named(kind, of).map(Self::Worker))
            .ok_or(NoOrder)
    }
}

impl Order {
    /// What it would do.
    pub(super) async fn sheet(&self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::Day(order) => order.sheet(app).await,
            Self::Queue(order) => order.sheet(app).await,
            Self::Turn(order) => order.sheet(app).await,
            Self::Team(order) => order.sheet(app).await,
            Self::Stage(order) => order.sheet(app).await,
            Self::Worker(order) => Ok(order.sheet()),
        }
    }

    /// Does it, as the API's requests do, and says by which words that is told.
    pub(super) async fn carry_out(
        &self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        match self {
            Self::Day(order) => order.carry_out(app, actor, decision).await,
            Self::Queue(order) => order.carry_out(app, actor, decision).await,
            Self::Turn(order) => order.carry_out(app, actor, decision).await,
            Self::Team(order) => order.carry_out(app, actor, decision).await,
            Self::Stage(order) => order.carry_out(app, actor, decision).await,
            Self::Worker(order) => order.carry_out(app, actor, decision).await,
        }
    }
}
