//! Who works for the server on other machines.

use faceoff_types::{EvaluationId, GameId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

/// Who plays, and what keeps others from it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkersView {
    /// Slots of the server itself that play; 0 if others do.
    pub own_slots: u32,
    /// Slots elsewhere that can be given work now.
    pub remote_slots: u32,
    /// Is work given to other machines?
    pub is_given: bool,
    /// What the server cannot do for other machines, and why; empty if nothing is missing.
    #[schema(example = json!([]))]
    pub troubles: Vec<String>,
    /// What takes so long that it is worth a look; empty if nothing does.
    #[serde(default)]
    #[schema(example = json!([]))]
    pub alarms: Vec<String>,
    /// By name, as far as this process has heard of them.
    pub workers: Vec<WorkerView>,
    /// Of whom nothing is taken, by name.
    pub bans: Vec<WorkerBanView>,
}

/// A worker of which nothing is taken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerBanView {
    /// What it is called.
    #[schema(example = "rack-1")]
    pub worker: String,
    /// Since when.
    pub at: Timestamp,
    /// Why.
    pub reason: String,
    /// Evaluations that count and of which it has played a part, the newest first, 100 at most: void what is not to be believed.
    #[schema(example = json!([]))]
    pub evaluations: Vec<EvaluationId>,
    /// Games that it has played and whose result counts, the newest first, 100 at most.
    #[schema(example = json!([]))]
    pub games: Vec<GameId>,
}

/// A worker on another machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerView {
    /// What it is called.
    #[schema(example = "rack-1")]
    pub name: String,
    /// The version of its program.
    pub version: String,
    /// Units that it works at at the same time.
    pub slots: u32,
    /// What its owner calls it by beside its name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!(["lab 3"]))]
    pub labels: Vec<String>,
    /// When the server heard of it first, since it was started.
    pub first_at: Timestamp,
    /// When it did last.
    pub last_at: Timestamp,
    /// How it stands.
    pub state: WorkerState,
    /// Why it gets no work; absent unless it is `refused`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// What its slots do.
    pub busy: Vec<BusyView>,
}

/// How a worker stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WorkerState {
    /// A slot has something to do.
    Working,
    /// None has.
    Idle,
    /// It is not like the server, and gets no work.
    Refused,
    /// Nothing was heard of it for half a minute.
    Silent,
}

/// What a slot does.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct BusyView {
    /// Which slot.
    #[schema(example = "slot-0")]
    pub slot: String,
    /// The unit of work, as the server's log names it.
    pub unit: Uuid,
    /// What it is; absent if it was begun before the server was started.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "hit episodes 0 to 49")]
    pub what: Option<String>,
    /// Since when.
    pub since: Timestamp,
    /// It takes longer than an hour.
    pub is_long: bool,
    /// What keeps it from handing in what came of it; absent if nothing does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trouble: Option<String>,
}
