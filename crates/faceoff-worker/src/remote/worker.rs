//! A process whose slots work for a server on another machine.

use super::{
    connection::{ANSWER, NatsConfig},
    far_server::FarServer,
    link::Link,
    names::{self, Names},
    transfer::{Carrier, Patience},
};
use crate::{
    boxed,
    evaluator::Runner,
    scratch::Scratch,
    service::{Intervals, SlotServer, SlotsConfig, run_slots},
};
use anyhow::Context as _;
use faceoff_store::WorkerName;
use faceoff_wire::remote::Introduction;
use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

#[derive(Debug, Clone)]
pub struct RemoteWorker {
    pub nats: NatsConfig,
    /// What it is called; no two of a server's are called alike.
    pub name: String,
    pub own: Introduction,
    /// Fetches and stores files. How long nothing may move is watched here: it has no such limit of its own.
    pub http: reqwest::Client,
    /// It ends once no slot has had anything to do for so long; none: it goes on.
    pub ends_after: Option<Duration>,
    pub slots: SlotsConfig,
}

/// How often a worker looks for how long it had nothing to do.
const LOOK: Duration = Duration::from_secs(1);

/// Works until `shutdown` is cancelled, or it had nothing to do for as long as it is to wait; then every unit is given back at once. While NATS or the server is away it waits.
///
/// # Errors
/// If a name is none, the scratch folder cannot be had, or a slot dies.
#[boxed]
pub async fn work(config: RemoteWorker, shutdown: CancellationToken) -> anyhow::Result<()> {
    let names = Names::of(&config.nats.name)?;
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
    let link = Arc::new(Link {
        runtime: Handle::current(),
        client,
        names,
        worker: name,
        own: config.own,
        carrier: Carrier {
            http: config.http,
            patience: Patience::default(),
        },
        shutdown: shutdown.clone(),
        refused: Mutex::default(),
        unread: Mutex::default(),
        busy_at: Mutex::new(Instant::now()),
        may_work_at: Mutex::default(),
    });
    if let Some(ends_after) = config.ends_after {
        let (link, shutdown) = (Arc::clone(&link), shutdown.clone());
        tokio::spawn(async move {
            while link.idle_for() < ends_after {
                tokio::time::sleep(LOOK.min(ends_after)).await;
            }
            tracing::info!(?ends_after, "ending: there was nothing to do");
            shutdown.cancel();
        });
    }
    let servers = (0..config.slots.cpus.slots.len()).map(|index| SlotServer {
        slot: format!("slot-{index}"),
        server: Arc::new(FarServer::new(Arc::clone(&link))),
    });
    let servers = servers.collect();
    let ended = run_slots(
        config.slots,
        &scratch,
        servers,
        Arc::new(Runner),
        Intervals::default(),
        shutdown,
    );
    ended.await.context("the worker's slots")?;
    // What was said last is to arrive, if NATS is there.
    let _ = tokio::time::timeout(ANSWER, link.client.flush()).await;
    Ok(())
}
