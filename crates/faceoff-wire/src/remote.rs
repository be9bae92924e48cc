//! JSON messages between the server and remote workers (processes on other machines that run jobs): jobs, requests of workers,
//! live updates of games, and results. They are sent over NATS, a message broker.

use crate::job::{JobReport, JobSpec, Lease};
use faceoff_types::{GameId, LiveEvent, LivePosition, RuntimeInventory};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A job for a remote worker, with access to its files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RemoteJob {
    /// The job.
    #[serde(rename = "order")]
    pub job: JobSpec,
    /// A sealed [`Grant`](crate::grant::Grant) for the job's files.
    pub grant: String,
    /// Base URL of the server's files (http or https), without a trailing slash.
    #[serde(rename = "files")]
    pub files_url: String,
    /// BLAKE3 of the server's executable, 64 hexadecimal digits. A worker with another executable does not start the job.
    #[serde(rename = "program")]
    pub program_blake3: String,
    /// Links to bundles and recordings, if they are in a storage bucket instead of on the server.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<ObjectLinks>,
}

/// Links to a job's files in a storage bucket. Each expires after a while and gives access to one file only.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ObjectLinks {
    /// Links to fetch bundles, by their BLAKE3.
    pub bundles: BTreeMap<String, String>,
    /// Links to store files, by file name.
    pub files: BTreeMap<String, String>,
}

/// A worker's executable and runtimes, by which the server decides whether the worker gets jobs, and its description for
/// organisers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkerCapabilities {
    /// BLAKE3 of its executable, 64 hexadecimal digits. Only the same executable computes the same bits.
    #[serde(rename = "program")]
    pub program_blake3: String,
    /// Version of its program, for display.
    pub version: String,
    /// Runtimes (language environments) that it offers to agents, with their content.
    pub runtimes: Vec<RuntimeInventory>,
    /// Number of jobs that it runs at a time.
    pub slots: u32,
    /// Labels given by its owner, for display.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

impl WorkerCapabilities {
    /// Maximum number of labels; further ones are ignored.
    pub const MAX_LABELS: usize = 8;
    /// Maximum length of a label in characters; longer ones are cut.
    pub const MAX_LABEL_CHARS: usize = 40;
}

/// A request of a worker, which the server answers at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WorkerRequest {
    /// Registers the worker, and asks whether it gets jobs.
    #[serde(rename = "may_work")]
    Register(WorkerCapabilities),
    /// Asks whether a worker with these capabilities would get jobs, without registering it.
    #[serde(rename = "would_work")]
    CheckRegistration(WorkerCapabilities),
    /// Asks for the exclusive right to run a job that it has received.
    #[serde(rename = "begin")]
    StartJob {
        /// The lease of the job.
        lease: Lease,
        /// Name of the slot that runs the job.
        slot: String,
    },
    /// Renews the lease of a job, and reports progress.
    #[serde(rename = "renew")]
    RenewLease {
        /// The lease of the job.
        lease: Lease,
        /// Number of episodes played so far; in a game, number of windows (parts of 500 control steps).
        episodes_done: u32,
        /// The problem that prevents the worker from sending the result, for organisers.
        #[serde(default, rename = "trouble", skip_serializing_if = "Option::is_none")]
        send_problem: Option<String>,
    },
    /// Reports that the result message is stored in NATS. From now on the server itself keeps the lease valid until it has accepted
    /// the result.
    #[serde(rename = "handed_in")]
    ResultPending {
        /// The lease of the job.
        lease: Lease,
        /// Number of episodes played so far; in a game, number of windows (parts of 500 control steps).
        episodes_done: u32,
        /// Sequence number of the message in the stream of results.
        sequence: u64,
    },
}

/// The response to a [`WorkerRequest`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WorkerResponse {
    /// The request is granted.
    #[serde(rename = "yes")]
    Accepted,
    /// The request is refused.
    #[serde(rename = "no")]
    Refused {
        /// The reason, for the worker's log.
        reason: String,
    },
    /// The server cannot answer now; the worker may ask again.
    #[serde(rename = "unknown")]
    Unavailable,
}

/// A live update of a running game. It has no influence on the result, and may get lost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LiveGameMessage {
    /// The lease under which the game is played.
    pub lease: Lease,
    /// Id of the game.
    pub game: GameId,
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// The update.
    #[serde(rename = "shown")]
    pub update: LiveGameUpdate,
}

/// A change in a running game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LiveGameUpdate {
    /// The game has started.
    #[serde(rename = "begun")]
    Started {
        /// Control steps of the whole game.
        steps: u32,
    },
    /// The game has progressed.
    #[serde(rename = "goes")]
    Progress {
        /// Events since the last update.
        #[serde(rename = "happenings")]
        events: Vec<LiveEvent>,
        /// The current positions.
        position: LivePosition,
    },
    /// The attempt is over; no further update follows.
    #[serde(rename = "over")]
    Ended,
}

/// The result of a job, as sent by a remote worker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultMessage {
    /// The lease of the job.
    pub lease: Lease,
    /// The sealed grant of the job.
    pub grant: String,
    /// How the job ended.
    #[serde(rename = "outcome")]
    pub end: RemoteJobEnd,
}

/// How a job ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RemoteJobEnd {
    /// The job is done, and its files are stored.
    Done {
        /// The report of the job.
        report: Box<JobReport>,
    },
    /// The job was interrupted without a fault: the worker shut down, or its program is of another version than the server's.
    /// The attempt does not count.
    #[serde(rename = "shutdown")]
    Interrupted,
    /// The disk was full; the attempt does not count.
    FullDisk,
    /// A platform fault.
    PlatformFault {
        /// A description for the team.
        reason: String,
    },
}

impl ResultMessage {
    /// Message id: job id and nonce of the lease. The server accepts at most one result per id.
    #[must_use]
    pub fn id(&self) -> String {
        Self::id_of(&self.lease)
    }

    /// [`Self::id`] of the result of a job under this lease.
    #[must_use]
    pub fn id_of(lease: &Lease) -> String {
        format!("{}/{}", lease.job_id, lease.nonce)
    }
}
