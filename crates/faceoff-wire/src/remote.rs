//! What passes between the server and workers on other machines, as JSON: orders, what is asked meanwhile, and what came of them.

use crate::work::{Lease, WorkOrder, WorkReport};
use faceoff_types::{GameId, LiveHappening, LivePosition, RuntimeInventory};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An order, and what it opens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RemoteOrder {
    /// What is to be done.
    pub order: WorkOrder,
    /// A sealed [`Grant`](crate::grant::Grant).
    pub grant: String,
    /// Where the server's files are: an address of http or https, without a slash at its end.
    pub files: String,
    /// BLAKE3 of the server's program, 64 hexadecimal digits: a worker that runs another declines.
    pub program: String,
    /// Where bundles and recordings are instead, if not with the server.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<Objects>,
}

/// Links to files of an order, good for a while and for nothing else.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Objects {
    /// By BLAKE3: to fetch.
    pub bundles: BTreeMap<String, String>,
    /// By name: to store.
    pub files: BTreeMap<String, String>,
}

/// What a worker is: its orders depend on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Introduction {
    /// BLAKE3 of the program that it runs, 64 hexadecimal digits: only the same program has the same bits.
    pub program: String,
    /// The program's version, for people.
    pub version: String,
    /// What it offers to agents, and what is in it.
    pub runtimes: Vec<RuntimeInventory>,
    /// Units that it works at at the same time.
    pub slots: u32,
    /// What its owner calls it by beside its name, for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

impl Introduction {
    /// More labels are left out.
    pub const MOST_LABELS: usize = 8;
    /// In characters; what is longer is cut.
    pub const LONGEST_LABEL: usize = 40;
}

/// What a worker asks, and is answered at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Ask {
    /// May it work?
    MayWork(Introduction),
    /// Might it work, if it were started?
    WouldWork(Introduction),
    /// It has an order, and is to be the only one that works at it.
    Begin {
        /// As the order has it.
        lease: Lease,
        /// Which of its slots.
        slot: String,
    },
    /// Is it still to work at an order?
    Renew {
        /// As the order has it.
        lease: Lease,
        /// How far it is.
        episodes_done: u32,
        /// What keeps it from handing in what came of it, in words for organisers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        trouble: Option<String>,
    },
    /// What came of an order is stored by NATS, and waits for the server: until it is taken in, the order is nobody else's.
    HandedIn {
        /// As the order has it.
        lease: Lease,
        /// How far it is.
        episodes_done: u32,
        /// Where it is in the stream of outcomes.
        sequence: u64,
    },
}

/// The answer to [`Ask`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Answer {
    /// Yes.
    Yes,
    /// No, and this is why.
    No {
        /// For the worker's log.
        reason: String,
    },
    /// Nobody can tell now; it may ask again.
    Unknown,
}

/// What is told of a game under way; it decides nothing, and may get lost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RemoteShow {
    /// Under which it is played.
    pub lease: Lease,
    /// Which.
    pub game: GameId,
    /// Which attempt at it, from 1.
    pub attempt: u32,
    /// What happens.
    pub shown: Shown,
}

/// What happens in a game under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Shown {
    /// It begins.
    Begun {
        /// Control steps that are to be played.
        steps: u32,
    },
    /// It goes on.
    Goes {
        /// What happened since.
        happenings: Vec<LiveHappening>,
        /// Where things are.
        position: LivePosition,
    },
    /// Nothing more comes.
    Over,
}

/// What came of an order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RemoteOutcome {
    /// As the order has it.
    pub lease: Lease,
    /// As the order has it.
    pub grant: String,
    /// What came of it.
    pub outcome: Outcome,
}

/// How work at an order ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// It is done; what is kept of it is stored.
    Done {
        /// What came of it.
        report: Box<WorkReport>,
    },
    /// The worker ends; the attempt does not count.
    Shutdown,
    /// There was no room for it; the attempt does not count.
    FullDisk,
    /// A fault of ours.
    PlatformFault {
        /// In words for the team.
        reason: String,
    },
}

impl RemoteOutcome {
    /// The name under which it is accepted once: unit and lease.
    #[must_use]
    pub fn id(&self) -> String {
        Self::id_of(&self.lease)
    }

    /// Likewise, of what comes of work under a lease.
    #[must_use]
    pub fn id_of(lease: &Lease) -> String {
        format!("{}/{}", lease.unit, lease.nonce)
    }
}
