//! Serves a season that is not archived: API, pages, worker slots and schedule in one process.

use super::{
    clock, expired_uploads,
    http::serve_http,
    monitoring,
    priority::low_priority_runtime,
    remote,
    resources::{ServerResources, print_address},
    runtime_inventory,
    sandbox::copy_to_memory,
    tasks::ServerTasks,
};
use crate::competition::competition;
use crate::{client, commands::atomic_folder::create_private, config::Config};
use anyhow::{Context, bail};
use faceoff_http::{AgentResources, Capacity, CapacityMonitor, ConnectionLimits};
use faceoff_live::LiveState;
use faceoff_notify::Deliverer;
use faceoff_runner::AgentEnvironment;
use faceoff_store::{Actor, JobFilter, Store, StoreError};
use faceoff_types::Clock;
use faceoff_worker::{CpuLayout, SlotThreads, SlotsConfig, WorkerConfig};
use jiff::Timestamp;
use std::sync::Arc;
use std::thread;
use tokio_util::sync::CancellationToken;

/// The CPUs and threads of the slots, and the runtimes and limits that the pages show to teams.
struct SlotResources {
    cpus: CpuLayout,
    threads: SlotThreads,
    agent_resources: AgentResources,
}

/// Serves the season until SIGINT or SIGTERM.
///
/// # Errors
/// If the data folder or an address is unusable, or a part of the server fails.
pub(super) fn run(config: Config, connections: ConnectionLimits) -> anyhow::Result<()> {
    let cpus = CpuLayout::for_server(config.slots(), &config.workers.agent_cpus);
    let agent_resources = runtime_inventory::agent_resources(&config, &cpus)?;
    let (threads, starter) = SlotThreads::from_starter();
    let slots = SlotResources {
        cpus,
        threads,
        agent_resources,
    };
    let service = thread::Builder::new()
        .name("service".to_owned())
        .spawn(move || {
            let runtime = low_priority_runtime(&slots.cpus.server)?;
            runtime.block_on(serve(config, connections, slots))
        })
        .context("starting the service thread")?;
    // The service thread runs requests, database and schedule. The threads of the slots are started on this thread, because they
    // inherit its CPUs and its priority.
    starter.run();
    service
        .join()
        .unwrap_or_else(|_| bail!("the service thread panicked"))
}

async fn serve(
    config: Config,
    connections: ConnectionLimits,
    slots: SlotResources,
) -> anyhow::Result<()> {
    let data_dir = config.server.data_dir.clone();
    create_private(&data_dir)?;
    let scratch_dir = config.scratch_dir();
    create_private(&scratch_dir)?;
    let resources =
        ServerResources::open(&config, vec![data_dir.clone(), scratch_dir.clone()]).await?;
    let (store, address) = (resources.store.clone(), resources.address);
    let clock = resources.clock.clone();
    log_upgrade(&store);
    shorten_due_times(&config, &store, clock.now()).await?;
    configure_season(&config, &store, clock.now()).await?;

    let mut agent = config.agent_environment();
    let capacity = capacity(&config, &slots.cpus, &agent);
    let live = LiveState::default();
    let capacity_monitor = CapacityMonitor::new(
        store.clone(),
        live.workers.clone(),
        clock.clone(),
        capacity.clone(),
    );
    let remote = remote::remote_config(&config, address, &resources.link_key, &agent)?;
    let http_config =
        resources.http_config(&config, clock.clone(), capacity, slots.agent_resources);
    let metrics = http_config.metrics.clone();
    let metrics_listener = match config.server.metrics_listen {
        Some(address) => Some(monitoring::listen(address).await?),
        None => None,
    };
    let router = faceoff_http::router(store.clone(), live.clone(), http_config.clone());
    let deliverer = webhook_deliverer(&config, &store, &clock)?;
    // The copy of the runtimes' files in memory lasts as long as this value, so as long as agents run.
    let _memory_copy = copy_to_memory(&mut agent.runtimes, config.sandbox.resident_bytes);
    let workers = WorkerConfig {
        slots: SlotsConfig {
            cpus: slots.cpus,
            threads: slots.threads,
            scratch_dir,
            agent,
            metrics: metrics.clone(),
        },
        // With `play = false`, only remote workers run evaluations and games.
        job_filter: match config.workers.play {
            true => JobFilter::All,
            false => JobFilter::ValidationAndScoring,
        },
        lease_s: config.workers.lease_s,
        bundle_limits: config.bundle,
    };
    tracing::info!(
        %address,
        data_dir = %data_dir.display(),
        slots = workers.slots.cpus.slots.len(),
        service_cpus = ?workers.slots.cpus.server,
        "serving"
    );

    let mut tasks = ServerTasks::default();
    if let Some(remote) = remote {
        let (store, live) = (store.clone(), live.clone());
        let (clock, workers) = (clock.clone(), workers.clone());
        tasks.spawn(|shutdown| {
            faceoff_worker::dispatch(store, live, clock, workers, remote, shutdown)
        });
    }
    tasks.spawn(|shutdown| {
        faceoff_worker::run(
            store.clone(),
            live.clone(),
            clock.clone(),
            workers,
            shutdown,
        )
    });
    let upload_dir = resources.upload_dir.clone();
    tasks.spawn(|shutdown| expired_uploads::remove(upload_dir, clock.clone(), shutdown));
    tasks.spawn(|shutdown| clock::watch(clock.clone(), data_dir, shutdown));
    tasks.spawn(|shutdown| {
        faceoff_worker::run_schedule(store.clone(), Arc::clone(competition()), clock, shutdown)
    });
    tasks.spawn(|shutdown| async move {
        capacity_monitor.run(shutdown.cancelled_owned()).await;
        Ok(())
    });
    tasks.spawn(|shutdown| monitoring::count_changes(store.clone(), metrics, shutdown));
    if let Some(listener) = metrics_listener {
        let store = store.clone();
        tasks.spawn(|shutdown| {
            monitoring::serve_metrics(listener, store, live, http_config, shutdown)
        });
    }
    let webhooks_enabled = config.webhooks.enabled;
    tasks.spawn(move |shutdown| deliver_webhooks(deliverer, webhooks_enabled, shutdown));
    tasks.spawn(|shutdown| serve_http(resources.listener, router, connections, shutdown));
    print_address(address);
    tasks.run_until_signal(&store).await
}

fn log_upgrade(store: &Store) {
    if let Some(upgrade) = store.upgrade() {
        tracing::info!(
            from = upgrade.from.as_deref().unwrap_or("an earlier version"),
            from_schema = upgrade.from_schema,
            to = upgrade.to.version,
            to_schema = upgrade.to.schema,
            "database upgraded"
        );
    }
}

/// Jobs must not wait for a time that was stored when the clock was ahead.
async fn shorten_due_times(config: &Config, store: &Store, now: Timestamp) -> anyhow::Result<()> {
    match store.shorten_due_times(config.workers.lease_s, now).await {
        Ok(0) => {}
        Ok(jobs) => {
            tracing::warn!(
                jobs,
                "jobs were due too far in the future, as if the clock had been ahead; they are due now"
            );
        }
        // The server must start nevertheless.
        Err(error @ StoreError::DiskFull(_)) => {
            tracing::warn!(%error, "the due times of jobs could not be checked");
        }
        Err(error) => return Err(error).context("checking the due times of jobs"),
    }
    Ok(())
}

/// Applies the configured name of the season, and the configured rules and settings of its first stage.
async fn configure_season(config: &Config, store: &Store, now: Timestamp) -> anyhow::Result<()> {
    if let Some(name) = &config.season.name {
        store
            .name_season(Actor::Operator, name, now)
            .await
            .context("naming the season")?;
    }
    let season = store.season().await.context("reading the season")?;
    config
        .check_season_magnitudes(season.secret.model_mismatch())
        .context("the configuration")?;
    store
        .configure_stage(
            config.rules(),
            config.settings()?,
            config.evaluation.zone.clone(),
            now,
        )
        .await
        .context("evaluation: setting the rules of the season's first stage")
}

fn capacity(config: &Config, cpus: &CpuLayout, agent: &AgentEnvironment) -> Capacity {
    Capacity {
        longest_episode_s: competition().longest_episode_s(),
        slots: match config.workers.play {
            true => u32::try_from(cpus.slots.len()).unwrap_or(u32::MAX),
            false => 0,
        },
        time: config.time.clone(),
        runtimes: agent.runtime_names(),
    }
}

fn webhook_deliverer(config: &Config, store: &Store, clock: &Clock) -> anyhow::Result<Deliverer> {
    let tls = client::tls_client_config(None).unwrap_or_else(|error| {
        // Evaluations do not depend on webhooks, and pending deliveries are retried after the restart.
        tracing::error!(%error, "deliveries to webhooks with TLS fail: install the package ca-certificates and restart");
        client::plain_client_config()
    });
    Deliverer::new(store.clone(), clock.clone(), config.webhooks.clone(), tls)
        .context("setting up the delivery of webhooks")
}

async fn deliver_webhooks(
    deliverer: Deliverer,
    enabled: bool,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    if enabled {
        deliverer.run(shutdown).await;
    } else {
        shutdown.cancelled().await;
    }
    Ok(())
}
