//! Store. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_types::*;
use jiff::{Timestamp, civil::Date};
use std::path::Path;
use serde::{Serialize, Deserialize};

#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("{0} not found")] NotFound(&'static str),
    #[error("a team named {0:?} exists already")] TeamNameTaken(String),
    #[error("this team was evaluated on {day} already; the next turn is on {next}")] AlreadyEvaluated { day: Date, next: Date },
    #[error("{0}")] Conflict(String),
    #[error("database: {0}")] Database(#[source] sqlx::Error),
    #[error("artifacts: {0}")] Artifacts(String),
    #[error("stored value is damaged: {0}")] Damaged(String),
}

/// Handle to SQLite (WAL; one write connection beside a read pool) and artifacts (object_store). Clone is cheap.
#[derive(Debug, Clone)]
pub struct Store;
impl Store {
    /// Opens (creates, migrates) `data_dir`/faceoff.sqlite3 and `data_dir`/artifacts.
    pub async fn open(data_dir: &Path) -> Result<Self, StoreError> { unimplemented!() }

    // --- season (secret made at first open; commitment = BLAKE3 of the secret, public) ---
    pub async fn season(&self) -> Result<Season, StoreError> { unimplemented!() }

    // --- teams ---
    pub async fn create_team(&self, name: &TeamName, token_hash: [u8; 32], now: Timestamp) -> Result<Team, StoreError> { unimplemented!() }
    pub async fn team(&self, id: TeamId) -> Result<Team, StoreError> { unimplemented!() }
    pub async fn team_by_token_hash(&self, token_hash: [u8; 32]) -> Result<Option<Team>, StoreError> { unimplemented!() }
    pub async fn teams(&self) -> Result<Vec<Team>, StoreError> { unimplemented!() }
    /// replaces a lost token
    pub async fn set_team_token(&self, id: TeamId, token_hash: [u8; 32]) -> Result<(), StoreError> { unimplemented!() }

    // --- submissions ---
    /// Records an uploaded bundle whose bytes are an artifact already (`Artifacts`); state = Validating (queued).
    pub async fn create_submission(&self, team: TeamId, bundle: BundleRef, now: Timestamp) -> Result<Submission, StoreError> { unimplemented!() }
    pub async fn submission(&self, id: SubmissionId) -> Result<Submission, StoreError> { unimplemented!() }
    /// newest first
    pub async fn submissions_of(&self, team: TeamId) -> Result<Vec<Submission>, StoreError> { unimplemented!() }

    // --- evaluations ---
    /// One counting evaluation for a team's newest valid submission and UTC day: AlreadyEvaluated if the day's turn is used. Creates its shards.
    pub async fn create_evaluation(&self, submission: SubmissionId, plan: &EvaluationPlan, now: Timestamp) -> Result<Evaluation, StoreError> { unimplemented!() }
    pub async fn evaluation(&self, id: EvaluationId) -> Result<Evaluation, StoreError> { unimplemented!() }
    pub async fn evaluations_of(&self, team: TeamId) -> Result<Vec<Evaluation>, StoreError> { unimplemented!() }
    pub async fn evaluations_on(&self, day: Date) -> Result<Vec<Evaluation>, StoreError> { unimplemented!() }
    /// Starts the day: an evaluation of the newest valid submission of each team that has not used its turn. Returns what was created.
    pub async fn start_day(&self, plan: &EvaluationPlan, now: Timestamp) -> Result<Vec<Evaluation>, StoreError> { unimplemented!() }
    /// Board source: each team's newest finished counting evaluation.
    pub async fn board(&self) -> Result<Vec<BoardRecord>, StoreError> { unimplemented!() }

    // --- work queue (one claim = one UPDATE … RETURNING on an IMMEDIATE write) ---
    /// Leases the next unit of work for `lease_s` seconds: smoke runs first, then shards in evaluation order. Expired leases are leased again.
    pub async fn claim(&self, worker: &str, lease_s: u32, now: Timestamp) -> Result<Option<Work>, StoreError> { unimplemented!() }
    /// Extends the lease and stores progress (episodes done); false = the lease was lost or the work cancelled: stop.
    pub async fn heartbeat(&self, claim: &Claim, episodes_done: u32, lease_s: u32, now: Timestamp) -> Result<bool, StoreError> { unimplemented!() }
    pub async fn commit_smoke(&self, claim: &Claim, outcome: SmokeOutcome, now: Timestamp) -> Result<(), StoreError> { unimplemented!() }
    /// Idempotent; a commit of a lost lease or twice changes nothing and says so. `recording` = artifact key.
    pub async fn commit_shard(&self, claim: &Claim, commit: ShardCommit, now: Timestamp) -> Result<Committed, StoreError> { unimplemented!() }
    /// Our fault: the unit goes back to the queue; after `max_attempts` the evaluation becomes PlatformFailed and the team's turn is given back (smoke: submission back to queue, then ValidationError).
    pub async fn release_failed(&self, claim: &Claim, reason: &str, now: Timestamp) -> Result<(), StoreError> { unimplemented!() }
    /// Shutdown: give the unit back at once, no attempt counted.
    pub async fn release(&self, claim: &Claim, now: Timestamp) -> Result<(), StoreError> { unimplemented!() }
    /// Shards of an evaluation in (task, first episode) order, with recording keys, for finalisation.
    pub async fn shards(&self, evaluation: EvaluationId) -> Result<Vec<Shard>, StoreError> { unimplemented!() }
    /// Evaluations whose shards are all done but which are not finished yet are claimed as `Work::Finalise`.
    /// Stores result and dataset key and state Finished in one transaction.
    pub async fn finish_evaluation(&self, claim: &Claim, result: &EvaluationResult, dataset: &str, now: Timestamp) -> Result<(), StoreError> { unimplemented!() }

    pub fn artifacts(&self) -> &Artifacts { unimplemented!() }
}

#[derive(Debug, Clone)] pub struct Season { pub name: String, pub secret: Seed, pub commitment: String, pub created_at: Timestamp }
#[derive(Debug, Clone, PartialEq)] pub struct Team { pub id: TeamId, pub name: TeamName, pub created_at: Timestamp }
#[derive(Debug, Clone, PartialEq)] pub struct BundleRef { /** artifact key */ pub key: String, pub bytes: u64, pub blake3: String, /** original file name, for its format */ pub file_name: String }
#[derive(Debug, Clone, PartialEq)] pub struct Submission { pub id: SubmissionId, pub team: TeamId, pub bundle: BundleRef, pub created_at: Timestamp, /** known once unpacked */ pub agent_name: Option<String>, pub state: SubmissionState }
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum SubmissionState {
    Validating { attempts: u32 },
    Valid { log: String },
    Invalid { reason: String, log: String },
    /// our fault, after several attempts; the team may upload again
    ValidationError { reason: String },
}
#[derive(Debug, Clone, PartialEq)] pub struct EvaluationPlan { pub profile: Profile, pub tasks: Vec<Task>, pub episodes_per_task: u32, pub episodes_per_shard: u32, pub max_faults: u32 }
#[derive(Debug, Clone, PartialEq)] pub struct Evaluation { pub id: EvaluationId, pub submission: SubmissionId, pub team: TeamId, pub day: Date, pub plan: EvaluationPlan, pub created_at: Timestamp, pub state: EvaluationState }
#[derive(Debug, Clone, PartialEq)]
pub enum EvaluationState {
    Queued,
    Running { episodes_done: u32, episodes_total: u32 },
    /// all shards are in, the score is being computed
    Finalising,
    Finished { finished_at: Timestamp, result: Box<EvaluationResult>, dataset: String },
    /// too many agent faults
    AgentFailed { finished_at: Timestamp, faults: Vec<AgentFault>, log: String },
    /// our fault; the day's turn was given back
    PlatformFailed { finished_at: Timestamp, reason: String },
    Cancelled { finished_at: Timestamp, reason: String },
}
#[derive(Debug, Clone)] pub struct BoardRecord { pub team: Team, pub submission: Submission, pub evaluation: EvaluationId, pub day: Date, pub finished_at: Timestamp, pub result: EvaluationResult }

/// Proof of a lease: unit id + a nonce + attempt.
#[derive(Debug, Clone, PartialEq)] pub struct Claim { pub unit: uuid::Uuid, pub nonce: uuid::Uuid, pub lease_until: Timestamp }
#[derive(Debug, Clone)]
pub enum Work {
    Smoke { claim: Claim, submission: Submission },
    Shard { claim: Claim, evaluation: Evaluation, shard: Shard, bundle: BundleRef },
    Finalise { claim: Claim, evaluation: Evaluation, agent_name: String },
}
#[derive(Debug, Clone, PartialEq)] pub struct Shard { pub id: ShardId, pub task: Task, pub first_episode: u32, pub end_episode: u32, /** artifact key prefix once committed */ pub recording: Option<String> }
#[derive(Debug, Clone, PartialEq)] pub enum SmokeOutcome { Valid { agent_name: String, log: String }, Invalid { agent_name: Option<String>, reason: String, log: String } }
#[derive(Debug, Clone, PartialEq)] pub struct ShardCommit { pub outcomes: Vec<EpisodeOutcome>, pub log: String, pub stopped_by_faults: bool, pub recording: String }
#[derive(Debug, Clone, Copy, PartialEq, Eq)] pub enum Committed { Now, Before, LeaseLost }

/// Artifact files (bundles, shard recordings, datasets) in an object store; keys are slash-separated.
#[derive(Debug, Clone)]
pub struct Artifacts;
impl Artifacts {
    pub async fn put_file(&self, key: &str, file: &Path) -> Result<(), StoreError> { unimplemented!() }
    pub async fn get_to_file(&self, key: &str, file: &Path) -> Result<(), StoreError> { unimplemented!() }
    /// (length, stream) for downloads
    pub async fn read(&self, key: &str) -> Result<(u64, futures::stream::BoxStream<'static, Result<bytes::Bytes, StoreError>>), StoreError> { unimplemented!() }
    pub async fn delete(&self, key: &str) -> Result<(), StoreError> { unimplemented!() }
}
