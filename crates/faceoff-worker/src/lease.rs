//! Keeping a lease while a job runs. A *lease* is the right of a slot to run a job for some seconds; without renewals it
//! expires, and another slot may claim the job.

use crate::server::{JobServer, LeaseStatus, ReleaseReason};
use faceoff_types::{EpisodeOutcome, WINDOW_STEPS};
use faceoff_wire::job::Lease;
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

/// How often the keeper looks for new progress. It reports progress at once, without waiting for the next renewal, so that progress bars
/// move.
const PROGRESS_TICK: Duration = Duration::from_secs(1);

/// Keeps the lease of a job while a slot runs it. A thread renews the lease, reports progress and notices the loss of the
/// lease. At a shutdown it releases the job at once, whatever the slot is doing. Dropping the keeper waits for the
/// thread's current request, so a slot never ends before its job is released.
#[derive(Debug)]
pub(crate) struct LeaseKeeper {
    progress: Progress,
    /// Cancelled when the job is done, and at the shutdown.
    job_done: CancellationToken,
    /// `None` only while it is being dropped.
    thread: Option<JoinHandle<()>>,
}

/// State shared by the slot's thread and the keeper's.
#[derive(Debug, Clone, Default)]
pub(crate) struct Progress {
    /// Number of finished episodes of a shard; in a game, of finished windows of [`WINDOW_STEPS`] control steps.
    episodes_done: Arc<AtomicU32>,
    /// Cancelled by the keeper when the slot must stop the job.
    stop: CancellationToken,
}

impl LeaseKeeper {
    /// Starts the keeper. Fails if no thread can be started.
    pub(crate) fn start(
        server: Arc<dyn JobServer>,
        lease: Lease,
        shutdown: &CancellationToken,
    ) -> io::Result<Self> {
        let progress = Progress::default();
        let job_done = shutdown.child_token();
        let thread = thread::Builder::new()
            .name("faceoff-lease".to_owned())
            .spawn({
                let (progress, job_done, shutdown) =
                    (progress.clone(), job_done.clone(), shutdown.clone());
                move || keep_lease(&*server, &lease, &progress, &job_done, &shutdown)
            })?;
        Ok(Self {
            progress,
            job_done,
            thread: Some(thread),
        })
    }

    /// A handle for the slot's thread.
    pub(crate) fn progress(&self) -> Progress {
        self.progress.clone()
    }
}

impl Drop for LeaseKeeper {
    fn drop(&mut self) {
        self.job_done.cancel();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the lease keeper panicked; the lease will expire");
        }
    }
}

impl Progress {
    /// Must the slot stop, because of the shutdown or a lost lease?
    pub(crate) fn must_stop(&self) -> bool {
        self.stop.is_cancelled()
    }

    /// Number of finished episodes of a shard, or of finished windows of a game.
    pub(crate) fn episodes_done(&self) -> u32 {
        self.episodes_done.load(Ordering::Relaxed)
    }

    /// Reports the number of control steps of a game played so far.
    pub(crate) fn game_stepped(&self, steps: u32) {
        self.episodes_done
            .store(steps / WINDOW_STEPS, Ordering::Relaxed);
    }
}

impl faceoff_runner::Observer for Progress {
    fn on_episode_end(&mut self, _outcome: &EpisodeOutcome) {
        self.episodes_done.fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.must_stop()
    }
}

/// Renews the lease until the job is done (`job_done` is cancelled), the lease is lost or the process shuts down
/// (`shutdown` is cancelled, and with it `job_done`).
fn keep_lease(
    server: &dyn JobServer,
    lease: &Lease,
    progress: &Progress,
    job_done: &CancellationToken,
    shutdown: &CancellationToken,
) {
    let interval = server.renewal_interval(lease);
    let mut reported_episodes = 0;
    let mut renewed_at = Instant::now();
    // Only the first of several failures in a row is logged.
    let mut last_renewal_failed = false;
    loop {
        // Without a queue version, new jobs do not end the wait.
        let queue_version = None;
        server.wait(job_done, interval.min(PROGRESS_TICK), queue_version);
        if shutdown.is_cancelled() {
            progress.stop.cancel();
            if let Err(error) = server.release(lease, ReleaseReason::Interrupted) {
                tracing::warn!(job = %lease.job_id, cause = format!("{error:#}"), "the job could not be released; its lease will expire");
            }
            return;
        }
        if job_done.is_cancelled() {
            return;
        }
        let episodes_done = progress.episodes_done.load(Ordering::Relaxed);
        if episodes_done == reported_episodes && renewed_at.elapsed() < interval {
            continue;
        }
        match server.renew(lease, episodes_done) {
            Ok(LeaseStatus::Held) => {
                reported_episodes = episodes_done;
                renewed_at = Instant::now();
                last_renewal_failed = false;
            }
            Ok(LeaseStatus::Lost) => {
                progress.stop.cancel();
                return;
            }
            // The next tick tries again. If the lease expires meanwhile, the commit notices it.
            Err(error) => {
                if !last_renewal_failed {
                    tracing::warn!(job = %lease.job_id, cause = format!("{error:#}"), "the lease was not renewed; trying again");
                }
                last_renewal_failed = true;
            }
        }
    }
}
