//! The state of a server process that is in memory only: the games that are being played, for viewers in the browser, and
//! the remote workers that have contacted the server.
//!
//! A restart loses it, so nothing that must survive one belongs here: leases, results and bans are in the store. This crate
//! does no I/O and reads no clock.

mod games;
mod workers;

pub use games::{LiveCursor, LiveGames, LiveSubscription, LiveUpdate};
pub use workers::{
    SlotReport, SlotStatus, UploadGuard, WORKER_TIMEOUT, WorkerInfo, WorkerStatus, Workers,
};

/// The live state of a process. Cloning is cheap: all clones share the state.
#[derive(Debug, Clone, Default)]
pub struct LiveState {
    /// Games that the server's own slots and remote workers play.
    pub games: LiveGames,
    /// Remote workers, which are processes on other machines that run jobs.
    pub workers: Workers,
}
