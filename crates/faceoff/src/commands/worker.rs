//! `faceoff worker`: runs a *remote worker*, a process on another machine that runs jobs of the server. A *slot* is a place for one
//! job at a time; NATS is the message server between workers and server.

use super::{
    files_client::files_client,
    reported_capabilities::own_capabilities,
    serve::{check_sandbox, copy_to_memory},
};
use crate::{config::Config, log::LogFormat};
use anyhow::{Context as _, anyhow};
use clap::Args;
use faceoff_metrics::Metrics;
use faceoff_sandbox::probe_host;
use faceoff_types::is_printable;
use faceoff_wire::remote::WorkerCapabilities;
use faceoff_worker::{CpuLayout, RemoteWorkerConfig, SlotThreads, SlotsConfig};
use jiff::SignedDuration;
use std::{
    fs,
    io::{self, Write as _},
    os::unix::fs::OpenOptionsExt as _,
    path::{Path, PathBuf},
};
use tokio_util::sync::CancellationToken;

/// Runs jobs of a server on this machine, as a remote worker.
///
/// The worker gets episodes and games from the server through NATS. It needs the same build of this program, the
/// runtimes that the server offers, and a host with the same isolation. It needs no data folder and learns no secret.
/// SIGTERM releases running jobs.
#[derive(Debug, Args)]
pub struct WorkerCommand {
    /// Configuration file, of which [nats], [workers], [sandbox] and [runtimes] are used [default: faceoff.toml in
    /// the working folder, if it exists]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// NATS server; overrides nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// Name of this worker [default: the host's name]
    #[arg(long)]
    name: Option<String>,
    /// Number of jobs in parallel; overrides workers.slots of the configuration
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// Up to 8 labels, shown to organisers beside the name, e.g. "lab 3,borrowed"
    #[arg(long, value_name = "TEXT,…", value_delimiter = ',', value_parser = parse_label)]
    labels: Vec<String>,
    /// Folder for temporary files, used by this worker only; overrides workers.scratch_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    scratch_dir: Option<PathBuf>,
    /// Exit after all slots have been idle for this time, e.g. 10m [default: never]
    #[arg(long, value_name = "TIME")]
    drain_after_idle: Option<SignedDuration>,
    /// Create a key that identifies a server or worker to NATS: write the secret seed to FILE (for nats.nkey_file),
    /// print the public key (for the configuration of NATS), and exit
    #[arg(long, value_name = "FILE")]
    make_key: Option<PathBuf>,
    /// Format of the log on standard error; RUST_LOG sets the log level
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

impl WorkerCommand {
    /// Runs the worker until SIGINT or SIGTERM.
    ///
    /// # Errors
    /// If the configuration, the scratch folder or the sandbox is unusable.
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(file) = &self.make_key {
            return make_key(file);
        }
        self.log_format.start()?;
        let mut config = Config::load(self.config.as_deref())?;
        config.override_nats_url(self.nats)?;
        if let Some(slots) = self.slots {
            config.override_slots(slots)?;
        }
        if let Some(scratch_dir) = self.scratch_dir {
            config.workers.scratch_dir = Some(scratch_dir);
        }
        let nats = config.nats.connection().ok_or_else(|| {
            anyhow!("no NATS server is configured: use --nats nats://HOST:4222, or set nats.url in the configuration")
        })?;
        let name = match self.name {
            Some(name) => name,
            None => host_name()?,
        };
        check_sandbox(&probe_host(), &config.sandbox.given_up)?;
        config.check_runtimes()?;
        let mut agent = config.agent_environment();
        let mut capabilities = own_capabilities(&agent, config.slots())?;
        anyhow::ensure!(
            self.labels.len() <= WorkerCapabilities::MAX_LABELS,
            "--labels: expected at most {}, got {}",
            WorkerCapabilities::MAX_LABELS,
            self.labels.len()
        );
        capabilities.labels = self.labels;
        let http = files_client(config.nats.ca_file.as_deref())?;
        // The copy of the runtimes' files in memory lasts as long as this value, so as long as agents run.
        let _memory_copy = copy_to_memory(&mut agent.runtimes, config.sandbox.resident_bytes);
        let scratch_dir = config.scratch_dir();
        fs::create_dir_all(&scratch_dir)
            .with_context(|| format!("creating the folder {}", scratch_dir.display()))?;
        let worker = RemoteWorkerConfig {
            nats,
            name,
            capabilities,
            http,
            exit_after_idle: self.drain_after_idle.map(SignedDuration::unsigned_abs),
            slots: SlotsConfig {
                cpus: CpuLayout::for_server(config.slots(), &config.workers.agent_cpus),
                threads: SlotThreads::from_caller(),
                scratch_dir,
                agent,
                metrics: Metrics::new(env!("CARGO_PKG_VERSION")),
            },
        };
        tracing::info!(
            name = worker.name,
            slots = worker.slots.cpus.slots.len(),
            nats = worker.nats.url,
            "worker started"
        );
        super::block_on_all_cpus(run_until_signal(worker))
    }
}

async fn run_until_signal(worker: RemoteWorkerConfig) -> anyhow::Result<()> {
    let shutdown = CancellationToken::new();
    let mut worker_task = tokio::spawn(faceoff_worker::run_remote_worker(worker, shutdown.clone()));
    let signal = super::serve::shutdown_signal()?;
    tokio::select! {
        name = signal => tracing::info!(signal = name, "shutting down: slots release their jobs"),
        outcome = &mut worker_task => return outcome.context("the worker panicked")?,
    }
    shutdown.cancel();
    let second_signal = super::serve::shutdown_signal()?;
    tokio::select! {
        outcome = worker_task => outcome.context("the worker panicked")?,
        name = second_signal => {
            tracing::warn!(signal = name, "second signal: stopping immediately");
            Ok(())
        }
    }
}

/// Writes the secret seed to a private file and prints the public key.
fn make_key(file: &Path) -> anyhow::Result<()> {
    let key = nkeys::KeyPair::new_user();
    let seed = key.seed().context("generating a key")?;
    let write = || -> io::Result<()> {
        let mut options = fs::OpenOptions::new();
        let mut writer = options
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(file)?;
        writeln!(writer, "{seed}")?;
        writer.sync_all()
    };
    write().with_context(|| format!("writing the key to {}", file.display()))?;
    println!("{}", key.public_key());
    Ok(())
}

/// Parses a label; refuses invisible characters.
fn parse_label(text: &str) -> Result<String, String> {
    let chars = text.chars().count();
    let max = WorkerCapabilities::MAX_LABEL_CHARS;
    if (1..=max).contains(&chars) && text.chars().all(is_printable) {
        return Ok(text.to_owned());
    }
    Err(format!(
        "expected 1 to {max} characters, none of them invisible"
    ))
}

/// The host's name, with characters that NATS subjects allow.
pub(super) fn host_name() -> anyhow::Result<String> {
    let name = rustix::system::uname();
    let name = name.nodename().to_string_lossy();
    let subject: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    anyhow::ensure!(
        !subject.is_empty(),
        "this host has no name; choose one with --name"
    );
    Ok(subject)
}
