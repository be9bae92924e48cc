use crate::{
    boxed,
    bundle_cache::BundleCache,
    cpus::{self, CpuLayout},
    evaluator::{Evaluator, Runner},
    executor::{AgentHost, Executor},
    full_disk::Pause,
    local::LocalServer,
    scratch::Scratch,
    server::WorkServer,
    slot::{Rests, Slot},
    slot_threads::SlotThreads,
    tidying,
};
use anyhow::Context as _;
use faceoff_metrics::Metrics;
use faceoff_runner::{AgentEnvironment, bundle::BundleLimits};
use faceoff_store::{Lot, Store, StoreError};
use faceoff_types::{AgentLimits, Clock};
use std::{path::PathBuf, sync::Arc, time::Duration};
use tokio::{runtime::Handle, sync::oneshot, task::JoinSet};
use tokio_util::sync::CancellationToken;

/// How often things are done that nothing calls for; tests are quicker.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Intervals {
    /// See [`Slot::idle_poll`].
    pub(crate) idle_poll: Duration,
    /// After faults of ours.
    pub(crate) rests: Rests,
    /// How often the recordings of evaluations that are over are removed.
    pub(crate) tidy: Duration,
    /// How long slots may take to leave what they are in the middle of (a step of an agent, an
    /// upload) once their units were given back.
    pub(crate) shutdown_grace: Duration,
}

impl Default for Intervals {
    fn default() -> Self {
        Self {
            idle_poll: Duration::from_secs(2),
            rests: Rests {
                first: Duration::from_secs(2),
                longest: Duration::from_secs(300),
            },
            tidy: Duration::from_secs(300),
            shutdown_grace: Duration::from_secs(20),
        }
    }
}

/// How this process works.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    pub slots: SlotsConfig,
    /// Which work they do.
    pub lot: Lot,
    /// How long a claim lasts without renewal, seconds; after a crash the work rests that long.
    pub lease_s: u32,
    /// What an archive may hold.
    pub bundle_limits: BundleLimits,
}

/// How slots work, whoever gives them work.
#[derive(Debug, Clone)]
pub struct SlotsConfig {
    /// The slots, each with its CPUs; at least one. So many units are worked on at a time.
    pub cpus: CpuLayout,
    /// Who starts the slots' threads.
    pub threads: SlotThreads,
    /// A folder of this process's own for unpacked bundles and recordings; emptied at the start.
    pub scratch_dir: PathBuf,
    /// How agents are run; each slot's agent on the slot's CPUs.
    pub agent: AgentEnvironment,
    /// What slots do is counted here.
    pub metrics: Metrics,
}

/// Runs a named thread per slot (`faceoff-slot-0` …) until `shutdown` is cancelled. On a shutdown every
/// unit is given back at once, and the threads are waited for, for 20 s at most: an agent in the
/// middle of an answer may take that long. Fails if the scratch folder cannot be had or a slot dies.
#[boxed]
pub async fn run(
    store: Store,
    clock: Clock,
    config: WorkerConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let server = config.local_server(store, clock);
    let slots_server = Arc::new(server.clone());
    let evaluator = Arc::new(Runner);
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
    /// Hands out work as configured here.
    pub(crate) fn local_server(&self, store: Store, clock: Clock) -> LocalServer {
        LocalServer {
            store,
            runtime: Handle::current(),
            clock,
            lease_s: self.lease_s,
            pause: Pause::default(),
            limits: AgentLimits {
                bundle: self.bundle_limits,
                resources: self.slots.agent.limits.clone(),
                time: self.slots.agent.time.clone(),
            },
            lot: self.lot,
        }
    }
}

/// `slots_server` is what the slots see of `server`.
pub(crate) async fn run_with(
    server: LocalServer,
    slots_server: Arc<dyn WorkServer>,
    evaluator: Arc<dyn Evaluator>,
    config: WorkerConfig,
    intervals: Intervals,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    anyhow::ensure!(config.lease_s > 0, "a lease lasts at least one second");
    let folder = config.slots.scratch_dir.clone();
    let scratch = tokio::task::spawn_blocking(move || Scratch::take(&folder)).await??;

    match server.end_leases_of(scratch.worker()).await {
        Ok(0) => {}
        Ok(ended) => tracing::info!(units = ended, "taken over from this worker's last life"),
        // they end by themselves, if later
        Err(error @ StoreError::FullDisk(_)) => {
            tracing::warn!(%error, "the leases of this worker's last life stay until they run out");
        }
        Err(error) => return Err(error.into()),
    }

    let tidying = tokio::spawn(tidy(server, intervals.tidy, shutdown.clone()));
    let of_slots = (0..config.slots.cpus.slots.len()).map(|index| SlotServer {
        slot: format!("{}/slot-{index}", scratch.worker()),
        server: Arc::clone(&slots_server),
    });
    let of_slots = of_slots.collect();
    let ended = run_slots(
        config.slots,
        &scratch,
        of_slots,
        evaluator,
        intervals,
        shutdown,
    )
    .await;
    tidying.abort();
    ended
}

/// What a slot is called, and who gives it work.
pub(crate) struct SlotServer {
    pub(crate) slot: String,
    pub(crate) server: Arc<dyn WorkServer>,
}

/// Runs the slots, for as many servers, until `shutdown` is cancelled.
pub(crate) async fn run_slots(
    config: SlotsConfig,
    scratch: &Scratch,
    servers: Vec<SlotServer>,
    evaluator: Arc<dyn Evaluator>,
    intervals: Intervals,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    anyhow::ensure!(
        !config.cpus.slots.is_empty(),
        "a worker needs at least one slot"
    );
    let stop = shutdown.child_token();
    // However this function ends, its threads do, too.
    let _stop = stop.clone().drop_guard();
    tokio::spawn(tell_who_stands_still(config.metrics.clone(), stop.clone()));
    let mut slots = JoinSet::new();
    let all = config.cpus.slots.into_iter().zip(servers);
    for (index, (cpus, SlotServer { slot: name, server })) in all.enumerate() {
        let folder = scratch.slot(index)?;
        let slot = Slot {
            name,
            number: index.to_string(),
            metrics: config.metrics.clone(),
            idle_poll: intervals.idle_poll,
            rests: intervals.rests,
            executor: Executor {
                timing: None,
                server: Arc::clone(&server),
                evaluator: Arc::clone(&evaluator),
                host: AgentHost {
                    isolation: config.agent.isolation.clone(),
                    runtimes: config.agent.runtimes.clone(),
                    images: config.agent.images,
                    cpus,
                },
                bundles: BundleCache::new(&folder),
                folder,
            },
            server,
            shutdown: stop.clone(),
        };
        let end = start(&config.threads, index, slot)?;
        slots.spawn(async move { end.await.map_err(|_| index) });
    }
    wait_for(slots, intervals.shutdown_grace, &stop).await
}

/// Starts a slot's thread; the receiver hears of its end, or of its panic by the sender's drop.
fn start(threads: &SlotThreads, index: usize, slot: Slot) -> anyhow::Result<oneshot::Receiver<()>> {
    let (ended, end) = oneshot::channel();
    threads
        .start(format!("faceoff-slot-{index}"), move || {
            cpus::pin_simulator(&slot.executor.host.cpus.simulator);
            slot.run();
            // nobody listens any more after the grace
            let _ = ended.send(());
        })
        .context("starting a slot's thread")?;
    Ok(end)
}

/// Waits for the end of all slots. One that dies takes the others down: a server that looks well and
/// does half of the work helps nobody.
async fn wait_for(
    mut slots: JoinSet<Result<(), usize>>,
    shutdown_grace: Duration,
    stop: &CancellationToken,
) -> anyhow::Result<()> {
    let all = async {
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
        died = all => {
            anyhow::ensure!(died.is_empty(), "slots {died:?} died");
            Ok(())
        }
        () = overdue => {
            tracing::warn!("a slot is still in the middle of something; its unit was given back");
            Ok(())
        }
    }
}

/// Keeps the numbers, and with them the server's health, up to date about slots that something holds.
async fn tell_who_stands_still(metrics: Metrics, stop: CancellationToken) {
    const EVERY: Duration = Duration::from_secs(1);
    loop {
        metrics
            .slots()
            .set_standing_still(faceoff_runner::standing_still());
        tokio::select! {
            () = stop.cancelled() => return,
            () = tokio::time::sleep(EVERY) => {}
        }
    }
}

/// Clears away, now and then, what nobody needs.
async fn tidy(server: LocalServer, every: Duration, shutdown: CancellationToken) {
    loop {
        tidying::tidy(&server.store, server.clock.now()).await;
        tokio::select! {
            () = shutdown.cancelled() => return,
            () = tokio::time::sleep(every) => {}
        }
    }
}
