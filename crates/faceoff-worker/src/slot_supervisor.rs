//! Starts and supervises the slots of a worker process; each slot is a thread that runs one job at a time. Also holds their
//! configuration.

use crate::{
    boxed_future,
    bundle_cache::BundleCache,
    cleanup,
    cpus::{self, CpuLayout},
    evaluator::{Evaluator, Runner},
    executor::{AgentHost, Executor},
    files::FileStore,
    full_disk::ClaimPause,
    local::LocalServer,
    scorer::Scorer,
    scratch::Scratch,
    server::JobServer,
    slot::{Backoff, Slot},
    slot_threads::SlotThreads,
};
use anyhow::Context as _;
use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_runner::{AgentEnvironment, bundle::BundleLimits};
use faceoff_store::{JobFilter, Store, StoreError};
use faceoff_types::{AgentLimits, Clock};
use std::{path::PathBuf, sync::Arc, time::Duration};
use tokio::{runtime::Handle, sync::oneshot, task::JoinSet};
use tokio_util::sync::CancellationToken;

/// Intervals of periodic tasks; tests use shorter ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Intervals {
    /// See [`Slot::idle_poll`].
    pub(crate) idle_poll: Duration,
    /// Pauses of a slot after platform faults.
    pub(crate) backoff: Backoff,
    /// Interval of the cleanup of old data.
    pub(crate) cleanup: Duration,
    /// How long slots may take to finish their current operation (a step of an agent, an upload) after the release of
    /// their jobs.
    pub(crate) shutdown_grace: Duration,
}

impl Default for Intervals {
    fn default() -> Self {
        Self {
            idle_poll: Duration::from_secs(2),
            backoff: Backoff {
                first: Duration::from_secs(2),
                longest: Duration::from_secs(300),
            },
            cleanup: Duration::from_secs(300),
            shutdown_grace: Duration::from_secs(20),
        }
    }
}

/// Configuration of the server's own worker, which runs in its process.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    pub slots: SlotsConfig,
    /// The kinds of jobs that its slots run.
    pub job_filter: JobFilter,
    /// Duration of a lease without renewal, seconds. After a crash, jobs wait this long.
    pub lease_s: u32,
    /// Limits of bundles.
    pub bundle_limits: BundleLimits,
}

/// Configuration of slots, local or remote.
#[derive(Debug, Clone)]
pub struct SlotsConfig {
    /// The slots, each with its CPUs; at least one. Each slot runs one job at a time.
    pub cpus: CpuLayout,
    /// Starts the slots' threads.
    pub threads: SlotThreads,
    /// A folder for unpacked bundles and recordings, used by this process alone; emptied at the start.
    pub scratch_dir: PathBuf,
    /// Environment of agents; the CPUs are set per slot.
    pub agent: AgentEnvironment,
    /// Metrics of the slots.
    pub metrics: Metrics,
}

/// Runs a named thread per slot (`faceoff-slot-0` …) until `shutdown` is cancelled. On shutdown all jobs are released at
/// once; the threads are given 20 s to end, since an agent may be in the middle of an answer. Fails if the scratch folder
/// cannot be locked or a slot dies.
#[boxed_future]
pub async fn run(
    store: Store,
    live: LiveState,
    clock: Clock,
    config: WorkerConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let server = config.local_server(store, live, clock);
    let slots_server = Arc::new(server.clone());
    let evaluator = Arc::new(Runner {
        simulator: config.slots.agent.simulator.clone(),
    });
    run_with(
        server,
        slots_server,
        evaluator,
        config,
        Intervals::default(),
        shutdown,
    )
    .await
}

impl WorkerConfig {
    /// The job server with this configuration.
    pub(crate) fn local_server(&self, store: Store, live: LiveState, clock: Clock) -> LocalServer {
        LocalServer {
            store,
            live,
            runtime: Handle::current(),
            clock,
            lease_s: self.lease_s,
            claim_pause: ClaimPause::default(),
            limits: AgentLimits {
                bundle: self.bundle_limits,
                resources: self.slots.agent.limits.clone(),
                time: self.slots.agent.time.clone(),
            },
            job_filter: self.job_filter,
            simulator: Arc::clone(&self.slots.agent.simulator),
        }
    }
}

/// [`run`] with another evaluator and other intervals. `slots_server` is the server that the slots use; in tests it may wrap `server`.
pub(crate) async fn run_with(
    server: LocalServer,
    slots_server: Arc<dyn JobServer>,
    evaluator: Arc<dyn Evaluator>,
    config: WorkerConfig,
    intervals: Intervals,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    anyhow::ensure!(config.lease_s > 0, "a lease lasts at least one second");
    let checked = server.competition().check();
    checked.map_err(|problem| anyhow::anyhow!("the competition is refused: {problem}"))?;
    let folder = config.slots.scratch_dir.clone();
    let scratch = tokio::task::spawn_blocking(move || Scratch::take(&folder)).await??;

    match server.end_leases_of(scratch.worker()).await {
        Ok(0) => {}
        Ok(released) => tracing::info!(
            jobs = released,
            "released the jobs of this worker's previous process"
        ),
        // These leases expire anyway.
        Err(error @ StoreError::DiskFull(_)) => {
            tracing::warn!(%error, "the leases of this worker's previous process remain until they expire");
        }
        Err(error) => return Err(error.into()),
    }

    let files = server.files();
    let cleanup = tokio::spawn(run_cleanup(server, intervals.cleanup, shutdown.clone()));
    let slot_setups = (0..config.slots.cpus.slots.len()).map(|index| SlotSetup {
        slot: format!("{}/slot-{index}", scratch.worker()),
        server: Arc::clone(&slots_server),
        files: Arc::new(files.clone()),
        scorer: Some(Scorer {
            files: files.clone(),
        }),
    });
    let slot_setups = slot_setups.collect();
    let result = run_slots(
        config.slots,
        &scratch,
        slot_setups,
        evaluator,
        intervals,
        shutdown,
    )
    .await;
    cleanup.abort();
    result
}

/// What a slot needs: its name, the server from which it gets jobs, and their files.
pub(crate) struct SlotSetup {
    pub(crate) slot: String,
    pub(crate) server: Arc<dyn JobServer>,
    pub(crate) files: Arc<dyn FileStore>,
    /// See [`Executor::scorer`].
    pub(crate) scorer: Option<Scorer>,
}

/// Runs one slot per entry of `slot_setups` until `shutdown` is cancelled.
pub(crate) async fn run_slots(
    config: SlotsConfig,
    scratch: &Scratch,
    slot_setups: Vec<SlotSetup>,
    evaluator: Arc<dyn Evaluator>,
    intervals: Intervals,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    anyhow::ensure!(
        !config.cpus.slots.is_empty(),
        "a worker needs at least one slot"
    );
    let stop = shutdown.child_token();
    // Ends the threads when this function ends, for whatever reason.
    let _stop = stop.clone().drop_guard();
    tokio::spawn(report_stuck_slots(config.metrics.clone(), stop.clone()));
    let mut slots = JoinSet::new();
    let cpus_and_setups = config.cpus.slots.into_iter().zip(slot_setups);
    for (index, (cpus, slot_setup)) in cpus_and_setups.enumerate() {
        let SlotSetup {
            slot: name,
            server,
            files,
            scorer,
        } = slot_setup;
        let folder = scratch.slot(index)?;
        let slot = Slot {
            name,
            number: index.to_string(),
            metrics: config.metrics.clone(),
            idle_poll: intervals.idle_poll,
            backoff: intervals.backoff,
            executor: Executor {
                timing: None,
                server: Arc::clone(&server),
                files,
                scorer,
                evaluator: Arc::clone(&evaluator),
                host: AgentHost {
                    isolation: config.agent.isolation.clone(),
                    runtimes: config.agent.runtimes.clone(),
                    images: config.agent.images,
                    cpus,
                    simulator: config.agent.simulator.clone(),
                },
                bundles: BundleCache::new(&folder),
                folder,
            },
            server,
            shutdown: stop.clone(),
        };
        let end = start_thread(&config.threads, index, slot)?;
        // The task fails with the slot's index if its thread panics.
        slots.spawn(async move { end.await.map_err(|_| index) });
    }
    wait_for_slots(slots, intervals.shutdown_grace, &stop).await
}

/// Starts a slot's thread. The receiver gets a value at its normal end, and an error if it panics.
fn start_thread(
    threads: &SlotThreads,
    index: usize,
    slot: Slot,
) -> anyhow::Result<oneshot::Receiver<()>> {
    let (ended, end) = oneshot::channel();
    threads
        .start(format!("faceoff-slot-{index}"), move || {
            cpus::pin_simulator(&slot.executor.host.cpus.simulator);
            slot.run();
            // After the grace period there is no receiver.
            let _ = ended.send(());
        })
        .context("starting a slot's thread")?;
    Ok(end)
}

/// Waits for the end of all slots, but after `stop` no longer than the grace period. If a slot dies, the others are stopped, too: a
/// server must not look healthy while only part of its slots run.
async fn wait_for_slots(
    mut slots: JoinSet<Result<(), usize>>,
    shutdown_grace: Duration,
    stop: &CancellationToken,
) -> anyhow::Result<()> {
    let all_ended = async {
        let mut died = Vec::new();
        while let Some(ended) = slots.join_next().await {
            if let Ok(Err(index)) = ended {
                tracing::error!(slot = index, "the slot's thread panicked");
                died.push(index);
                stop.cancel();
            }
        }
        died
    };
    let overdue = async {
        stop.cancelled().await;
        tokio::time::sleep(shutdown_grace).await;
    };
    tokio::select! {
        died = all_ended => {
            anyhow::ensure!(died.is_empty(), "slots {died:?} died");
            Ok(())
        }
        () = overdue => {
            tracing::warn!("a slot has not ended in time; its job was released");
            Ok(())
        }
    }
}

/// Keeps the metric of stuck slots up to date. A slot is stuck if its thread is blocked although its agents have ended. A server with
/// such a slot reports itself as not healthy.
async fn report_stuck_slots(metrics: Metrics, stop: CancellationToken) {
    const INTERVAL: Duration = Duration::from_secs(1);
    loop {
        metrics.slots().set_stuck(faceoff_runner::stuck_threads());
        tokio::select! {
            () = stop.cancelled() => return,
            () = tokio::time::sleep(INTERVAL) => {}
        }
    }
}

/// Removes obsolete data periodically.
async fn run_cleanup(server: LocalServer, interval: Duration, shutdown: CancellationToken) {
    loop {
        cleanup::clean_up(&server.store, server.competition(), &server.clock).await;
        tokio::select! {
            () = shutdown.cancelled() => return,
            () = tokio::time::sleep(interval) => {}
        }
    }
}
