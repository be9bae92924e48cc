//! Remote workers, which are processes on other machines that run jobs, and their slots, each of which runs one job at a time.

use faceoff_types::{EvaluationId, GameId, deprecated_names};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

/// Remote workers, and problems that keep them from working.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct WorkersView {
    /// Slots of the server itself; 0 if only remote workers run jobs.
    pub own_slots: u32,
    /// Slots of remote workers that can lease jobs now.
    pub remote_slots: u32,
    /// Whether the server leases jobs to remote workers.
    pub leases_jobs: bool,
    /// Problems that keep remote workers from working; empty without problems.
    #[schema(example = json!([]))]
    pub problems: Vec<String>,
    /// Jobs that have been running for unusually long, in words; empty without such jobs.
    #[serde(default)]
    #[schema(example = json!([]))]
    pub alarms: Vec<String>,
    /// By name; only workers that contacted this server process.
    pub workers: Vec<WorkerView>,
    /// Banned workers by name.
    pub bans: Vec<WorkerBanView>,
}
deprecated_names!(WorkersView { is_given => leases_jobs, troubles => problems });

/// A banned worker; the server rejects its results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerBanView {
    /// Name of the worker.
    #[schema(example = "rack-1")]
    pub worker: String,
    /// When it was banned.
    pub at: Timestamp,
    /// Why it was banned.
    pub reason: String,
    /// Evaluations that count and of which it ran a part, newest first, 100 at most. Void those that cannot be trusted.
    #[schema(example = json!([]))]
    pub evaluations: Vec<EvaluationId>,
    /// Games that it ran and whose result counts, newest first, 100 at most.
    #[schema(example = json!([]))]
    pub games: Vec<GameId>,
}

/// A remote worker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerView {
    /// Name of the worker.
    #[schema(example = "rack-1")]
    pub name: String,
    /// Version of its program.
    pub version: String,
    /// Jobs that it runs in parallel.
    pub slots: u32,
    /// Labels that its owner gave it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!(["lab 3"]))]
    pub labels: Vec<String>,
    /// Time of the first contact since this server process started.
    pub first_at: Timestamp,
    /// Time of the last contact.
    pub last_at: Timestamp,
    /// Its state.
    pub state: WorkerState,
    /// Why it is refused jobs; absent unless `state` is `refused`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// Its slots that run a job.
    pub busy: Vec<BusySlotView>,
}

/// State of a worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WorkerState {
    /// A slot runs a job.
    Working,
    /// No slot runs a job.
    Idle,
    /// It differs from the server, e.g. in version, and gets no jobs.
    Refused,
    /// No contact for half a minute.
    Silent,
}

/// A slot that runs a job.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct BusySlotView {
    /// Name of the slot.
    #[schema(example = "slot-0")]
    pub slot: String,
    /// Id of the job, as in the server's log.
    pub job: Uuid,
    /// Description of the job; absent if it started before this server process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "episodes 0 to 49 of a task")]
    pub job_description: Option<String>,
    /// When the job started.
    pub since: Timestamp,
    /// Whether the job has been running for more than an hour.
    pub is_long: bool,
    /// Why the slot cannot send its result; absent without a problem.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}
deprecated_names!(BusySlotView { unit => job, what => job_description, trouble => problem });
