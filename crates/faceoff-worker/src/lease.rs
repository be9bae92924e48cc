use crate::server::{GivenBack, Holding, WorkServer};
use faceoff_types::{EpisodeOutcome, WINDOW_STEPS};
use faceoff_wire::work::Lease;
use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How often progress is looked at, so that a progress bar moves.
const PROGRESS_TICK: Duration = Duration::from_secs(1);

/// Keeps a unit's lease while a slot works on it: a thread renews it, tells the progress, notices when
/// it is lost, and at a shutdown gives it back at once, whatever the slot is in the middle of.
/// Dropping it waits for what the thread is telling the server, so that a slot never ends before its
/// unit was given back.
#[derive(Debug)]
pub(crate) struct LeaseKeeper {
    progress: Progress,
    over: CancellationToken,
    /// `None` only while it is being dropped.
    thread: Option<JoinHandle<()>>,
}

/// What passes between the slot's thread and the keeper's.
#[derive(Debug, Clone, Default)]
pub(crate) struct Progress {
    /// Of a game, windows of control steps: what is to a game what an episode is to a shard.
    episodes_done: Arc<AtomicU32>,
    stop: CancellationToken,
}

impl LeaseKeeper {
    /// Fails when the host has no thread left.
    pub(crate) fn keep(
        server: Arc<dyn WorkServer>,
        lease: Lease,
        shutdown: &CancellationToken,
    ) -> io::Result<Self> {
        let progress = Progress::default();
        let over = shutdown.child_token();
        let thread = thread::Builder::new()
            .name("faceoff-lease".to_owned())
            .spawn({
                let (progress, over, shutdown) = (progress.clone(), over.clone(), shutdown.clone());
                move || keep(&*server, &lease, &progress, &over, &shutdown)
            })?;
        Ok(Self {
            progress,
            over,
            thread: Some(thread),
        })
    }

    /// For the slot's thread.
    pub(crate) fn progress(&self) -> Progress {
        self.progress.clone()
    }
}

impl Drop for LeaseKeeper {
    fn drop(&mut self) {
        self.over.cancel();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread that keeps a lease panicked; the lease will end");
        }
    }
}

impl Progress {
    /// Is the unit no longer this slot's?
    pub(crate) fn stopped(&self) -> bool {
        self.stop.is_cancelled()
    }

    /// So many control steps of a game were played.
    pub(crate) fn game_stepped(&self, steps: u32) {
        self.episodes_done
            .store(steps / WINDOW_STEPS, Ordering::Relaxed);
    }
}

impl faceoff_runner::Observer for Progress {
    fn episode_done(&mut self, _outcome: &EpisodeOutcome) {
        self.episodes_done.fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.stopped()
    }
}

/// Ends with the unit (`over`), with its lease or with the shutdown, which ends `over`, too.
fn keep(
    server: &dyn WorkServer,
    lease: &Lease,
    progress: &Progress,
    over: &CancellationToken,
    shutdown: &CancellationToken,
) {
    let due_every = server.renews_every(lease);
    let mut told = 0;
    let mut renewed_at = Instant::now();
    let mut failing = false;
    loop {
        server.wait(over, due_every.min(PROGRESS_TICK), None);
        if shutdown.is_cancelled() {
            progress.stop.cancel();
            if let Err(error) = server.give_back(lease, GivenBack::Shutdown) {
                tracing::warn!(unit = %lease.unit, cause = format!("{error:#}"), "the unit could not be given back; its lease will end");
            }
            return;
        }
        if over.is_cancelled() {
            return;
        }
        let done = progress.episodes_done.load(Ordering::Relaxed);
        if done == told && renewed_at.elapsed() < due_every {
            continue;
        }
        match server.renew(lease, done) {
            Ok(Holding::Held) => {
                told = done;
                renewed_at = Instant::now();
                failing = false;
            }
            Ok(Holding::Lost) => {
                progress.stop.cancel();
                return;
            }
            // The next tick tries again. Should the lease end meanwhile, the commit finds out.
            Err(error) => {
                if !failing {
                    tracing::warn!(unit = %lease.unit, cause = format!("{error:#}"), "the lease was not renewed; trying again");
                }
                failing = true;
            }
        }
    }
}
