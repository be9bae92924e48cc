//! `faceoff serve`: API, pages, worker slots and the daily schedule in one process.

mod answering;
mod archived;
mod folder;
mod looking_in;
mod remote;
mod watching;

pub use answering::signalled;
pub use folder::{ADMIN_TOKEN_FILE, claim};

use super::staging::private;
use crate::{client, config::Config, descriptors::Descriptors, log::LogFormat, machine};
use answering::answer;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_http::{Capacity, CapacityWatch, ConnectionLimits, HttpConfig, Offer};
use faceoff_metrics::Metrics;
use faceoff_notify::Deliverer;
use faceoff_sandbox::{HostFeature, Layer, MemoryImage, Runtime, affinity, probe_host};
use faceoff_store::{Actor, Lot, Room, Store};
use faceoff_types::Clock;
use faceoff_worker::{CpuLayout, SlotThreads, SlotsConfig, WorkerConfig};
use folder::{empty_folder, link_key, set_admin_token};
use jiff::Timestamp;
use sd_notify::NotifyState;
use std::{collections::BTreeMap, io::Write as _, net::SocketAddr, path::PathBuf, thread};
use tokio::{net::TcpListener, task::JoinSet};
use tokio_util::sync::CancellationToken;

/// Starts the competition server.
#[derive(Debug, Args)]
pub struct ServeCommand {
    /// Configuration file [default: faceoff.toml in the working folder, if there is one]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// Address of API and pages; replaces server.listen of the configuration
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Folder of database and artifacts; replaces server.data_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// NATS, by which workers on other machines are given work; replaces nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// How the log is written, to standard error; RUST_LOG sets what is logged
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

impl ServeCommand {
    /// Serves until SIGINT or SIGTERM.
    ///
    /// # Errors
    /// If the configuration, the data folder, the address or the sandbox is not as it must be.
    pub fn run(self) -> anyhow::Result<()> {
        self.log_format.start()?;
        let mut config = Config::load(self.config.as_deref())?;
        if let Some(listen) = self.listen {
            config.server.listen = listen;
        }
        if let Some(data_dir) = self.data_dir {
            config.server.data_dir = data_dir;
        }
        config.reach_nats(self.nats)?;
        let archived = super::block_on(async {
            let data_dir = &config.server.data_dir;
            let found = Store::archived_in(data_dir).await;
            found.with_context(|| format!("looking into the data folder {}", data_dir.display()))
        })?;
        if archived.is_none() {
            // Before anything is opened: a host that cannot hold agents must not look as if it could.
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
            "file descriptors are divided"
        );
        if descriptors.connections < connections.open {
            tracing::warn!(
                wanted = connections.open,
                "fewer connections than connections.most; raise the limit of descriptors (ulimit -n, LimitNOFILE=)"
            );
        }
        let connections = descriptors.limits(connections);
        if let Some(archived) = archived {
            // Without agents nothing needs CPUs of its own.
            return tokio::runtime::Builder::new_multi_thread()
                .enable_all()
                .build()
                .context("starting the async runtime")?
                .block_on(archived::serve(config, connections, archived));
        }
        let cpus = CpuLayout::of_a_server(config.slots(), &config.workers.agent_cpus);
        let offer = looking_in::offer(&config, &cpus)?;
        let (threads, starter) = SlotThreads::of_another();
        let service = thread::Builder::new()
            .name("service".to_owned())
            .spawn(move || serve_giving_way(config, connections, cpus, threads, offer))
            .context("starting the service's thread")?;
        // This thread keeps its CPUs and its priority, for the slots' threads to inherit.
        starter.tend();
        service
            .join()
            .unwrap_or_else(|_| bail!("the service's thread panicked"))
    }
}

/// Requests, the database and the schedule: whatever strangers do with them, slots come first. Threads
/// inherit from the one that starts them: most from this one. Those that a slot's request makes the runtime start
/// give way by themselves; a connection of the database that such a request opens keeps the slot's priority.
fn serve_giving_way(
    config: Config,
    connections: ConnectionLimits,
    cpus: CpuLayout,
    threads: SlotThreads,
    offer: Offer,
) -> anyhow::Result<()> {
    if let Err(error) = affinity::give_way(&cpus.service) {
        tracing::warn!(%error, cpus = ?cpus.service, "requests cannot be kept from disturbing slots");
    }
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("http")
        .on_thread_start({
            let (cpus, nice) = (
                cpus.service.clone(),
                affinity::niceness().unwrap_or_default(),
            );
            move || give_way_too(&cpus, nice)
        })
        .build()
        .context("starting the async runtime")?
        .block_on(serve(config, connections, cpus, threads, offer))
}

/// A thread of the runtime that was started for what a slot asked has the slot's priority until here, where
/// the others have the value `nice`.
fn give_way_too(cpus: &[usize], nice: i32) {
    if affinity::niceness().is_ok_and(|own| own < nice)
        && let Err(error) = affinity::give_way(cpus)
    {
        tracing::warn!(%error, ?cpus, "requests cannot be kept from disturbing slots");
    }
}

async fn serve(
    config: Config,
    connections: ConnectionLimits,
    cpus: CpuLayout,
    threads: SlotThreads,
    offer: Offer,
) -> anyhow::Result<()> {
    let data_dir = config.server.data_dir.clone();
    private(&data_dir)?;
    let _claimed = claim(&data_dir)?;
    let upload_dir = data_dir.join("uploads");
    // What a crash left half uploaded belongs to no submission.
    empty_folder(&upload_dir)?;
    let scratch_dir = config.scratch_dir();
    private(&scratch_dir)?;
    let watched = vec![data_dir.clone(), scratch_dir.clone()];
    let store = Store::open(&data_dir)
        .await
        .with_context(|| format!("opening the data folder {}", data_dir.display()))?
        .with_room(Room::new(watched, config.server.min_free_bytes));
    if let Some(upgrade) = store.upgrade() {
        tracing::info!(
            from = upgrade.from.as_deref().unwrap_or("an earlier version"),
            from_schema = upgrade.from_schema,
            to = upgrade.to.version,
            to_schema = upgrade.to.schema,
            "the database is upgraded"
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
    let address = listener
        .local_addr()
        .context("asking for the address that was bound")?;
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
        .context("evaluation: giving the season's first stage its rules")?;
    let mut agent = config.agent_environment();
    let capacity = Capacity {
        slots: match config.workers.play {
            true => u32::try_from(cpus.slots.len()).unwrap_or(u32::MAX),
            false => 0,
        },
        time: config.time.clone(),
        runtimes: agent.offered(),
    };
    let watch = CapacityWatch::new(store.clone(), clock.clone(), capacity.clone());
    let metrics = Metrics::new(env!("CARGO_PKG_VERSION"));
    let link_key = link_key(&data_dir)?;
    let given_elsewhere = remote::config(&config, address, &link_key, &agent)?;
    let site = HttpConfig {
        max_bundle_bytes: config.bundle.packed_bytes,
        public_url: config.server.public_url.clone(),
        upload_dir,
        clock: clock.clone(),
        limits: config.uploads.limits(),
        capacity,
        offer,
        webhooks: config.webhooks.clone(),
        rates: config.rates.limits(),
        link_key,
        metrics: metrics.clone(),
        process: machine::process,
    };
    let watched_at = match config.server.metrics_listen {
        Some(address) => Some(watching::listen(address).await?),
        None => None,
    };
    let router = faceoff_http::router(store.clone(), site.clone());
    let tls = client::trusting_tls(None).unwrap_or_else(|error| {
        // No evaluation depends on it, and what happens meanwhile is told once they are there.
        tracing::error!(%error, "webhooks behind TLS are told nothing: install the package ca-certificates and start again");
        client::no_tls()
    });
    let rules = config.webhooks.clone();
    let tells_webhooks = rules.enabled;
    let deliverer = Deliverer::new(store.clone(), clock.clone(), rules, tls)
        .context("setting up what tells webhooks")?;
    // For as long as agents run.
    let _image = in_memory(&mut agent.runtimes, config.sandbox.resident_bytes);
    let workers = WorkerConfig {
        slots: SlotsConfig {
            cpus,
            threads,
            scratch_dir,
            agent,
            metrics: metrics.clone(),
        },
        lot: match config.workers.play {
            true => Lot::All,
            false => Lot::Rest,
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
    let mut parts = JoinSet::new();
    if let Some(remote) = given_elsewhere {
        parts.spawn(faceoff_worker::dispatch(
            store.clone(),
            clock.clone(),
            workers.clone(),
            remote,
            shutdown.clone(),
        ));
    }
    parts.spawn(faceoff_worker::run(
        store.clone(),
        clock.clone(),
        workers,
        shutdown.clone(),
    ));
    parts.spawn(faceoff_worker::run_schedule(
        store.clone(),
        clock,
        shutdown.clone(),
    ));
    let asked_to_end = shutdown.clone();
    parts.spawn(async move {
        watch.run(asked_to_end.cancelled_owned()).await;
        Ok(())
    });
    parts.spawn(watching::count(store.clone(), metrics, shutdown.clone()));
    if let Some(listener) = watched_at {
        let store = store.clone();
        parts.spawn(watching::answer(listener, store, site, shutdown.clone()));
    }
    let asked_to_end = shutdown.clone();
    parts.spawn(async move {
        if tells_webhooks {
            deliverer.run(asked_to_end).await;
        } else {
            asked_to_end.cancelled().await;
        }
        Ok(())
    });
    parts.spawn(answer(listener, router, connections, shutdown.clone()));
    // For the program that started this one, whatever is logged: from now on a connection is answered,
    // and a port that the system chose is known. That nobody listens is no fault.
    let _ = writeln!(std::io::stdout(), "http://{address}");
    tell_host(NotifyState::Ready);

    let signal = signalled()?;
    let mut outcome = Ok(());
    tokio::select! {
        name = signal => tracing::info!(signal = name, "ending: slots give their work back"),
        Some(part) = parts.join_next() => outcome = ended_early(part),
    }
    tell_host(NotifyState::Stopping);
    shutdown.cancel();
    let rest = async {
        while let Some(part) = parts.join_next().await {
            let ended = part
                .context("a part of the server panicked")
                .and_then(|part| part);
            if outcome.is_ok() {
                outcome = ended;
            }
        }
    };
    // The second signal is for the impatient; leases make that safe.
    let second = signalled()?;
    tokio::select! {
        () = rest => {
            store.close().await;
            tracing::info!("ended");
        }
        name = second => tracing::warn!(signal = name, "ending at once"),
    }
    outcome
}

/// Tells the service manager that started this program, if there is one that wants to know.
fn tell_host(state: NotifyState<'_>) {
    if let Err(error) = sd_notify::notify(&[state]) {
        tracing::warn!(%error, "the service manager was not told how this program stands");
    }
}

/// A part of the server came to its end although nobody asked it to.
fn ended_early(part: Result<anyhow::Result<()>, tokio::task::JoinError>) -> anyhow::Result<()> {
    match part {
        Ok(Ok(())) => bail!("a part of the server ended by itself"),
        Ok(Err(error)) => Err(error),
        Err(panic) => Err(panic).context("a part of the server panicked"),
    }
}

/// Refuses a host that lacks a layer which the organiser has not given up by name.
pub fn check_sandbox(features: &[HostFeature], given_up: &[Layer]) -> anyhow::Result<()> {
    let mut missing = Vec::new();
    for feature in features.iter().filter(|feature| !feature.available) {
        if given_up.contains(&feature.layer) {
            tracing::warn!(layer = ?feature.layer, found = feature.found, "given up by configuration");
        } else {
            let cure = feature
                .cure
                .as_deref()
                .unwrap_or("none is known for this host");
            missing.push(format!(
                "{}: {}\n    cure: {cure}",
                name(feature.layer),
                feature.found
            ));
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    bail!(
        "this host cannot isolate agents as it must:\n  {}\n\
         `faceoff doctor` tells more. To run without a layer, at your own risk, name it in the \
         configuration: [sandbox] given_up = [\"…\"]",
        missing.join("\n  ")
    )
}

/// Has agents use a copy of the runtimes' files in memory, if there may be one.
pub fn in_memory(
    runtimes: &mut BTreeMap<String, Runtime>,
    limit_bytes: u64,
) -> Option<MemoryImage> {
    faceoff_sandbox::sweep_stale();
    match MemoryImage::make(runtimes, limit_bytes) {
        Ok(image) => {
            tracing::info!(bytes = image.bytes, folder = %image.folder().display(), "the runtimes' files are kept in memory");
            Some(image)
        }
        Err(why) => {
            tracing::warn!(
                %why,
                "the runtimes' files are not kept in memory: by what is read of them, and how fast, one \
                 agent may tell another something; offer smaller runtimes or raise sandbox.resident_bytes"
            );
            None
        }
    }
}

/// A layer's name as the configuration spells it.
fn name(layer: Layer) -> String {
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
            found: "what was found".into(),
            cure: Some("what to do".into()),
        }
    }

    #[test]
    fn a_missing_layer_stops_the_start_unless_it_is_given_up_by_name() {
        let features = [
            feature(Layer::Seccomp, true),
            feature(Layer::CgroupMemory, false),
        ];
        let error = check_sandbox(&features, &[]).unwrap_err().to_string();
        for part in [
            "cgroup-memory",
            "what was found",
            "what to do",
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
