use faceoff_types::{BundleRef, GameId, LiveHappening, LivePosition};
use faceoff_wire::work::{Lease, WorkOrder, WorkReport};
use std::{path::Path, time::Duration};
use tokio_util::sync::CancellationToken;

/// Where a slot gets its work and leaves what came of it: the one who owns queue and artifacts, in
/// this process or on another machine. A slot is a thread of its own, so every call blocks. Instants
/// are the server's: it stamps what it is told when it is told.
///
/// An error says that the outcome is unknown: what was asked for may have happened all the same.
pub(crate) trait WorkServer: Send + Sync {
    /// Leases the next unit of work to the slot of this name.
    fn claim(&self, slot: &str) -> anyhow::Result<Claimed>;

    /// Extends the lease and tells how far the work is.
    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<Holding>;

    /// How often a slot asks whether its work is still its own: three tries before the lease ends.
    fn renews_every(&self, lease: &Lease) -> Duration {
        Duration::from_secs(lease.duration_s.into()) / 3
    }

    /// Shows an attempt at a game to those who watch it. Cheap, and as good as it goes: a connection that is slow or
    /// broken loses positions.
    fn show(&self, lease: &Lease, attempt: (GameId, u32), show: GameShow);

    /// Stores what came of a unit; harmless when repeated under the same lease. What was uploaded
    /// under a lease that turns out to be lost is removed.
    fn commit(&self, lease: &Lease, report: WorkReport) -> anyhow::Result<Holding>;

    /// Puts a unit back into the queue. Of a lost lease nothing is recorded.
    fn give_back(&self, lease: &Lease, why: GivenBack<'_>) -> anyhow::Result<()>;

    /// Was it a full disk that made this fail, the slot's or the server's? Then nobody failed.
    fn met_full_disk(&self, error: &anyhow::Error) -> bool;

    /// Waits until `stop` is cancelled, `at_most` has passed or, given a mark, the queue has grown
    /// since.
    fn wait(&self, stop: &CancellationToken, at_most: Duration, queue: Option<QueueMark>);

    /// Copies an uploaded archive to a new file.
    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()>;

    /// Copies the files of a committed recording into an empty folder.
    fn fetch_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()>;

    /// Stores the files of a folder as a recording.
    fn store_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()>;

    /// Stores what replays of a shard's episodes are drawn from, in the place of what was there.
    fn store_clips(&self, key: &str, clips: &Path) -> anyhow::Result<()>;

    /// Stores a dataset, with what replays are drawn from; nobody sees it before the commit that names it.
    fn store_dataset(&self, key: &str, archive: &Path, clips: Option<&Path>) -> anyhow::Result<()>;
}

/// The answer to a claim.
#[derive(Debug)]
pub(crate) enum Claimed {
    Order(Box<WorkOrder>),
    /// There is nothing to do now.
    Nothing {
        /// From before the look at the queue, so that no later addition is missed.
        queue: QueueMark,
    },
}

/// A state of the queue that a slot has seen; another value after every addition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueMark(pub(crate) u64);

/// Whose the unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Holding {
    /// Still the asking slot's, or done by it.
    Held,
    /// Another's, or nobody's any more.
    Lost,
}

/// What is told of a game while a slot plays it. It decides nothing, and nobody waits for it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum GameShow {
    /// It begins; this many control steps are to be played.
    Begun { steps: u32 },
    /// What happened, and where things are.
    Goes {
        happenings: Vec<LiveHappening>,
        position: LivePosition,
    },
    /// Nothing more comes of this attempt.
    Over,
}

/// Why a unit goes back to the queue undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GivenBack<'a> {
    /// The slot is asked to end; the attempt does not count.
    Shutdown,
    /// There was no room for it; it is tried again once there is, and the attempt does not count.
    FullDisk,
    /// A fault of ours, in words for the team; after several the unit is given up.
    PlatformFault(&'a str),
}
