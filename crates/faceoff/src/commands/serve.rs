//! `faceoff serve`: API, pages, worker slots and schedule in one process. A *slot* runs one job at a time, e.g. the episodes of an
//! agent or a game; the *schedule* starts evaluation days.

mod archived_season;
mod data_folder;
mod http;
mod monitoring;
mod remote;
mod runtime_inventory;

pub use data_folder::{ADMIN_TOKEN_FILE, lock};
pub use http::shutdown_signal;

use super::atomic_folder::create_private;
use crate::{client, config::Config, descriptors::Descriptors, log::LogFormat, machine};
use anyhow::{Context, bail};
use clap::Args;
use data_folder::{empty_folder, load_or_create_link_key, set_admin_token};
use faceoff_http::{AgentResources, Capacity, CapacityMonitor, ConnectionLimits, HttpConfig};
use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_notify::Deliverer;
use faceoff_sandbox::{HostFeature, Layer, MemoryImage, Runtime, affinity, probe_host};
use faceoff_store::{Actor, FreeSpace, JobFilter, Store};
use faceoff_types::Clock;
use faceoff_worker::{CpuLayout, SlotThreads, SlotsConfig, WorkerConfig};
use http::serve_http;
use jiff::Timestamp;
use sd_notify::NotifyState;
use std::{collections::BTreeMap, io::Write as _, net::SocketAddr, path::PathBuf, thread};
use tokio::{net::TcpListener, task::JoinSet};
use tokio_util::sync::CancellationToken;

/// Starts the competition server.
#[derive(Debug, Args)]
pub struct ServeCommand {
    /// Configuration file [default: faceoff.toml in the working folder, if it exists]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// Address of API and pages; overrides server.listen of the configuration
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Folder of database and artifacts; overrides server.data_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// NATS server through which remote workers get jobs; overrides nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// Format of the log on standard error; RUST_LOG sets the log level
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

impl ServeCommand {
    /// Runs the server until SIGINT or SIGTERM.
    ///
    /// # Errors
    /// If the configuration, the data folder, the address or the sandbox is unusable.
    pub fn run(self) -> anyhow::Result<()> {
        self.log_format.start()?;
        let mut config = Config::load(self.config.as_deref())?;
        if let Some(listen) = self.listen {
            config.server.listen = listen;
        }
        if let Some(data_dir) = self.data_dir {
            config.server.data_dir = data_dir;
        }
        config.override_nats_url(self.nats)?;
        let archived = super::block_on(async {
            let data_dir = &config.server.data_dir;
            let archived = Store::archived_in(data_dir).await;
            archived.with_context(|| format!("reading the data folder {}", data_dir.display()))
        })?;
        if archived.is_none() {
            // Checked before anything is opened: a host that cannot isolate agents must not look as if it could.
            check_sandbox(&probe_host(), &config.sandbox.given_up)?;
            config.check_runtimes()?;
        }
        let connections = config.connections.limits();
        let descriptors = Descriptors::divide(Descriptors::raise(), config.slots(), &connections)?;
        tracing::info!(
            limit = descriptors.limit,
            reserved = descriptors.reserved,
            connections = descriptors.connections,
            per_address = descriptors.per_address,
            "file descriptors assigned"
        );
        if descriptors.connections < connections.open {
            tracing::warn!(
                wanted = connections.open,
                "fewer connections than connections.most: raise the limit of file descriptors (ulimit -n, LimitNOFILE=)"
            );
        }
        let connections = descriptors.limits(connections);
        if let Some(archived) = archived {
            // An archived season runs no agents, so no CPUs are reserved.
            return tokio::runtime::Builder::new_multi_thread()
                .enable_all()
                .build()
                .context("starting the async runtime")?
                .block_on(archived_season::serve(config, connections, archived));
        }
        let cpus = CpuLayout::for_server(config.slots(), &config.workers.agent_cpus);
        let resources = runtime_inventory::agent_resources(&config, &cpus)?;
        let (threads, starter) = SlotThreads::from_starter();
        let service = thread::Builder::new()
            .name("service".to_owned())
            .spawn(move || serve_with_low_priority(config, connections, cpus, threads, resources))
            .context("starting the service thread")?;
        // The threads of the slots are started on this thread, because they inherit its CPUs and its priority.
        starter.run();
        service
            .join()
            .unwrap_or_else(|_| bail!("the service thread panicked"))
    }
}

/// Runs requests, database and schedule with a lower priority than slots, so that requests do not disturb
/// evaluations. Threads inherit the priority of the thread that starts them, usually this one. A thread that the
/// runtime starts for a slot lowers its own priority; a database connection that a slot opens keeps the slot's.
fn serve_with_low_priority(
    config: Config,
    connections: ConnectionLimits,
    cpus: CpuLayout,
    threads: SlotThreads,
    resources: AgentResources,
) -> anyhow::Result<()> {
    if let Err(error) = affinity::lower_priority(&cpus.service) {
        tracing::warn!(%error, cpus = ?cpus.service, "cannot lower the priority of requests, which may disturb slots");
    }
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("http")
        .on_thread_start({
            let (cpus, nice) = (
                cpus.service.clone(),
                affinity::niceness().unwrap_or_default(),
            );
            move || lower_priority(&cpus, nice)
        })
        .build()
        .context("starting the async runtime")?
        .block_on(serve(config, connections, cpus, threads, resources))
}

/// Lowers the priority of a runtime thread that a slot has started and that has inherited the slot's priority. Other
/// threads already have the value `nice`.
fn lower_priority(cpus: &[usize], nice: i32) {
    if affinity::niceness().is_ok_and(|thread_nice| thread_nice < nice)
        && let Err(error) = affinity::lower_priority(cpus)
    {
        tracing::warn!(%error, ?cpus, "cannot lower the priority of requests, which may disturb slots");
    }
}

async fn serve(
    config: Config,
    connections: ConnectionLimits,
    cpus: CpuLayout,
    threads: SlotThreads,
    resources: AgentResources,
) -> anyhow::Result<()> {
    let data_dir = config.server.data_dir.clone();
    create_private(&data_dir)?;
    let _lock = lock(&data_dir)?;
    let upload_dir = data_dir.join("uploads");
    // A crash may have left half-uploaded files, which belong to no submission.
    empty_folder(&upload_dir)?;
    let scratch_dir = config.scratch_dir();
    create_private(&scratch_dir)?;
    let disks = vec![data_dir.clone(), scratch_dir.clone()];
    let store = Store::open(&data_dir)
        .await
        .with_context(|| format!("opening the data folder {}", data_dir.display()))?
        .with_free_space(FreeSpace::new(disks, config.server.min_free_bytes));
    if let Some(upgrade) = store.upgrade() {
        tracing::info!(
            from = upgrade.from.as_deref().unwrap_or("an earlier version"),
            from_schema = upgrade.from_schema,
            to = upgrade.to.version,
            to_schema = upgrade.to.schema,
            "database upgraded"
        );
    }
    let now = Timestamp::now();
    set_admin_token(&store, &data_dir, now).await?;
    if let Some(name) = &config.season.name {
        store
            .name_season(Actor::Organiser, name, now)
            .await
            .context("naming the season")?;
    }
    let listener = TcpListener::bind(config.server.listen)
        .await
        .with_context(|| {
            format!(
                "listening on {}; choose another address with --listen",
                config.server.listen
            )
        })?;
    let address = listener.local_addr().context("reading the bound address")?;
    let clock = Clock::new(Timestamp::now);
    let season = store.season().await.context("reading the season")?;
    config
        .check_robot(season.secret.model_mismatch())
        .context("the configuration")?;
    store
        .configure_stage(
            config.rules(),
            config.settings()?,
            config.evaluation.zone.clone(),
            clock.now(),
        )
        .await
        .context("evaluation: setting the rules of the season's first stage")?;
    let mut agent = config.agent_environment();
    let capacity = Capacity {
        slots: match config.workers.play {
            true => u32::try_from(cpus.slots.len()).unwrap_or(u32::MAX),
            false => 0,
        },
        time: config.time.clone(),
        runtimes: agent.runtime_names(),
    };
    let live = LiveState::default();
    let capacity_monitor = CapacityMonitor::new(
        store.clone(),
        live.workers.clone(),
        clock.clone(),
        capacity.clone(),
    );
    let metrics = Metrics::new(env!("CARGO_PKG_VERSION"));
    let link_key = load_or_create_link_key(&data_dir)?;
    let remote = remote::remote_config(&config, address, &link_key, &agent)?;
    let http_config = HttpConfig {
        max_bundle_bytes: config.bundle.packed_bytes,
        public_url: config.server.public_url.clone(),
        upload_dir,
        clock: clock.clone(),
        limits: config.uploads.limits(),
        capacity,
        agent_resources: resources,
        webhooks: config.webhooks.clone(),
        rate_limits: config.rates.limits(),
        link_key,
        metrics: metrics.clone(),
        process: machine::process,
    };
    let metrics_listener = match config.server.metrics_listen {
        Some(address) => Some(monitoring::listen(address).await?),
        None => None,
    };
    let router = faceoff_http::router(store.clone(), live.clone(), http_config.clone());
    let tls = client::tls_client_config(None).unwrap_or_else(|error| {
        // Evaluations do not depend on webhooks, and pending deliveries are retried after the restart.
        tracing::error!(%error, "deliveries to webhooks with TLS fail: install the package ca-certificates and restart");
        client::plain_client_config()
    });
    let webhooks = config.webhooks.clone();
    let webhooks_enabled = webhooks.enabled;
    let deliverer = Deliverer::new(store.clone(), clock.clone(), webhooks, tls)
        .context("setting up the delivery of webhooks")?;
    // Kept as long as agents run.
    let _image = hold_in_memory(&mut agent.runtimes, config.sandbox.resident_bytes);
    let workers = WorkerConfig {
        slots: SlotsConfig {
            cpus,
            threads,
            scratch_dir,
            agent,
            metrics: metrics.clone(),
        },
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
        service_cpus = ?workers.slots.cpus.service,
        "serving"
    );

    let shutdown = CancellationToken::new();
    // The tasks of the server. All of them run until the shutdown.
    let mut parts = JoinSet::new();
    if let Some(remote) = remote {
        parts.spawn(faceoff_worker::dispatch(
            store.clone(),
            live.clone(),
            clock.clone(),
            workers.clone(),
            remote,
            shutdown.clone(),
        ));
    }
    parts.spawn(faceoff_worker::run(
        store.clone(),
        live.clone(),
        clock.clone(),
        workers,
        shutdown.clone(),
    ));
    parts.spawn(faceoff_worker::run_schedule(
        store.clone(),
        clock,
        shutdown.clone(),
    ));
    let shutdown_requested = shutdown.clone();
    parts.spawn(async move {
        capacity_monitor
            .run(shutdown_requested.cancelled_owned())
            .await;
        Ok(())
    });
    parts.spawn(monitoring::count_changes(
        store.clone(),
        metrics,
        shutdown.clone(),
    ));
    if let Some(listener) = metrics_listener {
        let store = store.clone();
        parts.spawn(monitoring::serve_metrics(
            listener,
            store,
            live,
            http_config,
            shutdown.clone(),
        ));
    }
    let shutdown_requested = shutdown.clone();
    parts.spawn(async move {
        if webhooks_enabled {
            deliverer.run(shutdown_requested).await;
        } else {
            shutdown_requested.cancelled().await;
        }
        Ok(())
    });
    parts.spawn(serve_http(listener, router, connections, shutdown.clone()));
    // Once connections are accepted, the parent process can read the address, including a port that the system has chosen. A
    // closed standard output is no error.
    let _ = writeln!(std::io::stdout(), "http://{address}");
    notify_service_manager(NotifyState::Ready);

    let signal = shutdown_signal()?;
    let mut outcome = Ok(());
    tokio::select! {
        name = signal => tracing::info!(signal = name, "shutting down: slots release their jobs"),
        Some(part) = parts.join_next() => outcome = unexpected_end(part),
    }
    notify_service_manager(NotifyState::Stopping);
    shutdown.cancel();
    let end_of_parts = async {
        while let Some(part) = parts.join_next().await {
            let ended = part
                .context("a part of the server panicked")
                .and_then(|part| part);
            if outcome.is_ok() {
                outcome = ended;
            }
        }
    };
    // A second signal stops the server immediately, which leases make safe.
    let second_signal = shutdown_signal()?;
    tokio::select! {
        () = end_of_parts => {
            store.close().await;
            tracing::info!("stopped");
        }
        name = second_signal => tracing::warn!(signal = name, "second signal: stopping immediately"),
    }
    outcome
}

/// Reports a state to the service manager that has started this program, if there is one.
fn notify_service_manager(state: NotifyState<'_>) {
    if let Err(error) = sd_notify::notify(&[state]) {
        tracing::warn!(%error, "cannot notify the service manager");
    }
}

/// The error of a part of the server that ended before the shutdown.
fn unexpected_end(part: Result<anyhow::Result<()>, tokio::task::JoinError>) -> anyhow::Result<()> {
    match part {
        Ok(Ok(())) => bail!("a part of the server ended unexpectedly"),
        Ok(Err(error)) => Err(error),
        Err(panic) => Err(panic).context("a part of the server panicked"),
    }
}

/// Refuses a host that lacks a *layer* (one protection) of the sandbox which the configuration does not give up.
pub fn check_sandbox(features: &[HostFeature], given_up: &[Layer]) -> anyhow::Result<()> {
    let mut missing = Vec::new();
    for feature in features.iter().filter(|feature| !feature.available) {
        if given_up.contains(&feature.layer) {
            tracing::warn!(layer = ?feature.layer, found = feature.found, "sandbox layer given up by configuration");
        } else {
            let cure = feature.cure.as_deref().unwrap_or("not known for this host");
            missing.push(format!(
                "{}: {}\n    fix: {cure}",
                layer_name(feature.layer),
                feature.found
            ));
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    bail!(
        "this host cannot isolate agents sufficiently:\n  {}\n\
        Run `faceoff doctor` for details. To run without a layer, at your own risk, name it in the \
        configuration: [sandbox] given_up = [\"…\"]",
        missing.join("\n  ")
    )
}

/// Lets agents use a copy of the runtimes' files in memory, if it fits.
pub fn hold_in_memory(
    runtimes: &mut BTreeMap<String, Runtime>,
    limit_bytes: u64,
) -> Option<MemoryImage> {
    faceoff_sandbox::sweep_stale();
    match MemoryImage::make(runtimes, limit_bytes) {
        Ok(image) => {
            tracing::info!(bytes = image.bytes, folder = %image.folder().display(), "runtime files are held in memory");
            Some(image)
        }
        Err(error) => {
            tracing::warn!(
                %error,
                "runtime files are not held in memory, so agents can exchange information through the timing of file \
                accesses; offer smaller runtimes or raise sandbox.resident_bytes"
            );
            None
        }
    }
}

/// The name of a layer in the configuration.
fn layer_name(layer: Layer) -> String {
    serde_json::to_value(layer)
        .ok()
        .and_then(|value| value.as_str().map(str::to_owned))
        .unwrap_or_else(|| format!("{layer:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(layer: Layer, available: bool) -> HostFeature {
        HostFeature {
            layer,
            available,
            found: "no memory controller".into(),
            cure: Some("enable it".into()),
        }
    }

    #[test]
    fn missing_layer_stops_the_start_unless_given_up() {
        let features = [
            feature(Layer::Seccomp, true),
            feature(Layer::CgroupMemory, false),
        ];
        let error = check_sandbox(&features, &[]).unwrap_err().to_string();
        for part in [
            "cgroup-memory",
            "no memory controller",
            "enable it",
            "faceoff doctor",
            "given_up",
        ] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
        assert!(!error.contains("seccomp"));
        assert!(check_sandbox(&features, &[Layer::Seccomp]).is_err());
        check_sandbox(&features, &[Layer::CgroupMemory]).unwrap();
    }
}
