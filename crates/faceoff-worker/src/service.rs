use crate::{
    bundle_cache::BundleCache,
    clock::Clock,
    cpus::{self, CpuLayout, SlotCpus},
    evaluator::{Evaluator, Runner},
    scratch::Scratch,
    slot::Slot,
    units::Tools,
};
use anyhow::Context as _;
use faceoff_runner::{AgentEnvironment, bundle::BundleLimits};
use faceoff_store::Store;
use jiff::SignedDuration;
use std::{path::PathBuf, sync::Arc, thread, time::Duration};
use tokio::{runtime::Handle, sync::oneshot, task::JoinSet};
use tokio_util::sync::CancellationToken;

/// No artifact is under way longer than this.
const LONGEST_WRITE: SignedDuration = SignedDuration::from_hours(1);

/// What time means here; tests are quicker.
pub(crate) struct Pace {
    pub(crate) clock: Clock,
    /// See [`Slot::poll`].
    pub(crate) poll: Duration,
    /// How often the recordings of evaluations that are over are removed.
    pub(crate) tidy_every: Duration,
    /// How long slots may take to leave what they are in the middle of (a step of an agent, an
    /// upload) once their units were given back.
    pub(crate) shutdown_grace: Duration,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            clock: Clock::system(),
            poll: Duration::from_secs(2),
            tidy_every: Duration::from_secs(300),
            shutdown_grace: Duration::from_secs(20),
        }
    }
}

/// How this process works.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// Units worked on at a time; at least one.
    pub slots: usize,
    /// How long a claim lasts without renewal, seconds; after a crash the work rests that long.
    pub lease_s: u32,
    /// A folder of this process's own for unpacked bundles and recordings; emptied at the start.
    pub scratch_dir: PathBuf,
    /// How agents are run. With `agent_cpus` empty every slot gets CPUs by [`CpuLayout`]; otherwise
    /// all agents run on those given.
    pub agent: AgentEnvironment,
    /// What an archive may hold.
    pub bundle_limits: BundleLimits,
}

/// Runs `slots` named threads (`faceoff-slot-0` …) until `shutdown` is cancelled. On a shutdown every
/// unit is given back at once, and the threads are waited for, for 20 s at most: an agent in the
/// middle of an answer may take that long. Fails if the scratch folder cannot be had or a slot dies.
pub async fn run(
    store: Store,
    config: WorkerConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    run_with(store, config, shutdown, Arc::new(Runner), Pace::default()).await
}

pub(crate) async fn run_with(
    store: Store,
    config: WorkerConfig,
    shutdown: CancellationToken,
    evaluator: Arc<dyn Evaluator>,
    pace: Pace,
) -> anyhow::Result<()> {
    anyhow::ensure!(config.slots > 0, "a worker needs at least one slot");
    anyhow::ensure!(config.lease_s > 0, "a lease lasts at least one second");
    let folder = config.scratch_dir.clone();
    let scratch = tokio::task::spawn_blocking(move || Scratch::take(&folder)).await??;

    // A killed predecessor's units need not wait for their leases to run out.
    let ended = store
        .end_leases_of(scratch.worker(), pace.clock.now())
        .await?;
    if ended > 0 {
        tracing::info!(units = ended, "taken over from this worker's last life");
    }

    let layout = layout(&config);
    let stop = shutdown.child_token();
    // However this function ends, its threads do, too.
    let _stop = stop.clone().drop_guard();
    let mut slots = JoinSet::new();
    for (index, cpus) in layout.into_iter().enumerate() {
        let folder = scratch.slot(index)?;
        let mut agent = config.agent.clone();
        agent.agent_cpus = cpus.agent;
        let slot = Slot {
            name: format!("{}/slot-{index}", scratch.worker()),
            lease_s: config.lease_s,
            poll: pace.poll,
            tools: Tools {
                store: store.clone(),
                handle: Handle::current(),
                clock: pace.clock.clone(),
                evaluator: Arc::clone(&evaluator),
                agent,
                bundle_limits: config.bundle_limits,
                bundles: BundleCache::new(&folder),
                folder,
            },
            shutdown: stop.clone(),
        };
        let end = start(index, cpus.simulator, slot)?;
        slots.spawn(async move { end.await.map_err(|_| index) });
    }
    let tidying = tokio::spawn(tidy(store, pace.clock, pace.tidy_every, shutdown.clone()));

    let ended = wait_for(slots, pace.shutdown_grace, &stop).await;
    tidying.abort();
    ended
}

/// The CPUs of every slot.
fn layout(config: &WorkerConfig) -> Vec<SlotCpus> {
    if !config.agent.agent_cpus.is_empty() {
        let cpus = SlotCpus {
            simulator: Vec::new(),
            agent: config.agent.agent_cpus.clone(),
        };
        return vec![cpus; config.slots];
    }
    let layout = CpuLayout::divide(&cpus::allowed(), config.slots);
    if layout.shared {
        tracing::warn!(
            slots = config.slots,
            "fewer than two CPUs per slot: agents share theirs, and computation times are uneven"
        );
    }
    layout.slots
}

/// Starts a slot's thread; the receiver hears of its end, or of its panic by the sender's drop.
fn start(
    index: usize,
    simulator_cpus: Vec<usize>,
    slot: Slot,
) -> anyhow::Result<oneshot::Receiver<()>> {
    let (ended, end) = oneshot::channel();
    thread::Builder::new()
        .name(format!("faceoff-slot-{index}"))
        .spawn(move || {
            cpus::pin_this_thread(&simulator_cpus);
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

/// Removes, now and then, recordings that are no longer needed and what kills left half written.
async fn tidy(store: Store, clock: Clock, every: Duration, shutdown: CancellationToken) {
    loop {
        let now = clock.now();
        if let Err(error) = store.remove_old_recordings(now).await {
            tracing::warn!(%error, "old recordings could not be removed");
        }
        if let Err(error) = store
            .artifacts()
            .remove_abandoned(now - LONGEST_WRITE)
            .await
        {
            tracing::warn!(%error, "half-written artifacts could not be removed");
        }
        tokio::select! {
            () = shutdown.cancelled() => return,
            () = tokio::time::sleep(every) => {}
        }
    }
}
