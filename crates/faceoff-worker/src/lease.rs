use crate::clock::Clock;
use faceoff_store::{Claim, Store};
use faceoff_types::EpisodeOutcome;
use std::{
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};
use tokio::{runtime::Handle, task::JoinHandle, time::MissedTickBehavior};
use tokio_util::sync::CancellationToken;

/// How often progress is looked at, so that a progress bar moves.
const PROGRESS_TICK: Duration = Duration::from_secs(1);

/// Keeps a unit's lease while a slot works on it: a task renews it, stores the progress, notices when
/// it is lost, and at a shutdown gives it back at once, whatever the slot is in the middle of.
/// Dropping it ends the renewal.
#[derive(Debug)]
pub(crate) struct LeaseKeeper {
    progress: Progress,
    renewal: JoinHandle<()>,
}

/// What passes between the slot's thread and the renewal.
#[derive(Debug, Clone)]
pub(crate) struct Progress {
    episodes_done: Arc<AtomicU32>,
    stop: CancellationToken,
}

impl LeaseKeeper {
    /// Keeps `claim`, which was leased for `lease_s` seconds.
    pub(crate) fn keep(
        handle: &Handle,
        store: Store,
        claim: Claim,
        lease_s: u32,
        clock: Clock,
        shutdown: CancellationToken,
    ) -> Self {
        let progress = Progress {
            episodes_done: Arc::default(),
            stop: CancellationToken::new(),
        };
        let renewal = handle.spawn(renew(
            store,
            claim,
            lease_s,
            progress.clone(),
            clock,
            shutdown,
        ));
        Self { progress, renewal }
    }

    /// For the slot's thread.
    pub(crate) fn progress(&self) -> Progress {
        self.progress.clone()
    }
}

impl Drop for LeaseKeeper {
    fn drop(&mut self) {
        self.renewal.abort();
    }
}

impl Progress {
    /// Is the unit no longer this slot's?
    pub(crate) fn stopped(&self) -> bool {
        self.stop.is_cancelled()
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

async fn renew(
    store: Store,
    claim: Claim,
    lease_s: u32,
    progress: Progress,
    clock: Clock,
    shutdown: CancellationToken,
) {
    // three tries before the lease ends
    let due_every = Duration::from_secs(lease_s.into()) / 3;
    let mut ticks = tokio::time::interval(due_every.min(PROGRESS_TICK));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut told = 0;
    let mut renewed_at = tokio::time::Instant::now();
    loop {
        tokio::select! {
            biased;
            () = shutdown.cancelled() => {
                progress.stop.cancel();
                if let Err(error) = store.release(&claim, clock.now()).await {
                    tracing::warn!(unit = %claim.unit, %error, "the unit could not be given back; its lease will end");
                }
                return;
            }
            _ = ticks.tick() => {}
        }
        let done = progress.episodes_done.load(Ordering::Relaxed);
        if done == told && renewed_at.elapsed() < due_every {
            continue;
        }
        match store.heartbeat(&claim, done, lease_s, clock.now()).await {
            Ok(true) => {
                told = done;
                renewed_at = tokio::time::Instant::now();
            }
            Ok(false) => {
                progress.stop.cancel();
                return;
            }
            // The next tick tries again. Should the lease end meanwhile, the commit finds out.
            Err(error) => tracing::warn!(unit = %claim.unit, %error, "the lease was not renewed"),
        }
    }
}
