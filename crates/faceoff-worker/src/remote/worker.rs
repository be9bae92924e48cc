//! A process whose slots work for a server on another machine.

use super::{
    connection::NatsConfig,
    far_server::{FarServer, Link},
    names::{self, Names},
};
use crate::{
    evaluator::Runner,
    scratch::Scratch,
    service::{Intervals, SlotServer, SlotsConfig, run_slots},
};
use anyhow::Context as _;
use faceoff_wire::remote::Introduction;
use std::sync::{Arc, Mutex};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// A worker.
#[derive(Debug, Clone)]
pub struct RemoteWorker {
    /// Where NATS is.
    pub nats: NatsConfig,
    /// What it is called; no two of a server's are called alike.
    pub name: String,
    /// What it is.
    pub own: Introduction,
    /// Fetches and stores files.
    pub http: reqwest::Client,
    /// How it works.
    pub slots: SlotsConfig,
}

/// Works until `shutdown` is cancelled; then every unit is given back at once. While NATS or the server is away it waits.
///
/// # Errors
/// If a name is none, the scratch folder cannot be had, or a slot dies.
pub async fn work(config: RemoteWorker, shutdown: CancellationToken) -> anyhow::Result<()> {
    let names = Names::of(&config.nats.name)?;
    anyhow::ensure!(
        names::is_word(&config.name) && config.name != names::SERVER,
        "the worker's name: expected 1 to 64 of a-z, A-Z, 0-9, - and _, and not “server”, got {:?}; choose one with --name",
        config.name
    );
    let client = config.nats.connect(&config.name).await?;
    let folder = config.slots.scratch_dir.clone();
    let scratch = tokio::task::spawn_blocking(move || Scratch::take(&folder)).await??;
    let link = Arc::new(Link {
        runtime: Handle::current(),
        client,
        names,
        worker: config.name,
        own: config.own,
        http: config.http,
        shutdown: shutdown.clone(),
        refused: Mutex::default(),
    });
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
    // What was said last is to arrive.
    let _ = link.client.flush().await;
    Ok(())
}
