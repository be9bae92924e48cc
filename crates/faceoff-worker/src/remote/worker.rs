//! The process of a remote worker, which runs jobs of a server on another machine. It reaches the server over the message
//! broker NATS.

use super::{
    connection::{NatsConfig, REQUEST_TIMEOUT},
    names::{self, Names},
    server_client::ServerClient,
    transfer::{FileTransfer, TransferTimeouts},
    worker_link::WorkerLink,
};
use crate::{
    boxed_future,
    evaluator::Runner,
    scratch::Scratch,
    server::JobServer,
    slot_supervisor::{Intervals, SlotSetup, SlotsConfig, run_slots},
};
use anyhow::Context as _;
use faceoff_types::WorkerName;
use faceoff_wire::remote::WorkerCapabilities;
use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// Configuration of a remote worker.
#[derive(Debug, Clone)]
pub struct RemoteWorkerConfig {
    pub nats: NatsConfig,
    /// Name of the worker, unique among the server's workers.
    pub name: String,
    pub capabilities: WorkerCapabilities,
    /// HTTP client for files. It has no timeout of its own, since transfers are monitored for progress.
    pub http: reqwest::Client,
    /// Idle time after which the worker exits; `None`: never.
    pub exit_after_idle: Option<Duration>,
    pub slots: SlotsConfig,
}

/// How often the idle time is checked.
const IDLE_CHECK_INTERVAL: Duration = Duration::from_secs(1);

/// Runs jobs until `shutdown` is cancelled or the idle time is over; then all jobs are released at once. While NATS or the
/// server is unreachable it waits.
///
/// # Errors
/// If a name is invalid, the scratch folder cannot be locked, or a slot dies.
#[boxed_future]
pub async fn run_remote_worker(
    config: RemoteWorkerConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let names = Names::new(&config.nats.name)?;
    let name = config.name.parse::<WorkerName>().ok();
    let name = name.filter(|name| name.as_str() != names::SERVER);
    let name = name.with_context(|| {
        format!(
            "the worker's name: expected 1 to 64 of a-z, A-Z, 0-9, - and _, and not “server”, got {:?}; choose one with --name",
            config.name
        )
    })?;
    let client = config.nats.connect(&config.name, |_| ()).await?;
    let folder = config.slots.scratch_dir.clone();
    let scratch = tokio::task::spawn_blocking(move || Scratch::take(&folder)).await??;
    let link = Arc::new(WorkerLink {
        runtime: Handle::current(),
        client,
        names,
        worker: name,
        capabilities: config.capabilities,
        file_transfer: FileTransfer {
            http: config.http,
            timeouts: TransferTimeouts::default(),
        },
        shutdown: shutdown.clone(),
        refusal: Mutex::default(),
        unreadable_cause: Mutex::default(),
        busy_at: Mutex::new(Instant::now()),
        registered_at: Mutex::default(),
    });
    if let Some(exit_after_idle) = config.exit_after_idle {
        let (link, shutdown) = (Arc::clone(&link), shutdown.clone());
        tokio::spawn(async move {
            while link.idle_for() < exit_after_idle {
                tokio::time::sleep(IDLE_CHECK_INTERVAL.min(exit_after_idle)).await;
            }
            tracing::info!(ends_after = ?exit_after_idle, "ending: idle");
            shutdown.cancel();
        });
    }
    let slot_setups = (0..config.slots.cpus.slots.len()).map(|index| {
        let client = Arc::new(ServerClient::new(Arc::clone(&link)));
        SlotSetup {
            slot: format!("slot-{index}"),
            server: Arc::clone(&client) as Arc<dyn JobServer>,
            files: client,
            scorer: None,
        }
    });
    let slot_setups = slot_setups.collect();
    let evaluator = Arc::new(Runner {
        simulator: config.slots.agent.simulator.clone(),
    });
    let running = run_slots(
        config.slots,
        &scratch,
        slot_setups,
        evaluator,
        Intervals::default(),
        shutdown,
    );
    running.await.context("the worker's slots")?;
    // Sends the last messages, if NATS is reachable.
    let _ = tokio::time::timeout(REQUEST_TIMEOUT, link.client.flush()).await;
    Ok(())
}
