//! `faceoff worker`: slots that work for a server on another machine.

use super::{
    files_client::files_client,
    introduction::introduction,
    serve::{check_sandbox, in_memory},
};
use crate::{config::Config, log::LogFormat};
use anyhow::{Context as _, anyhow};
use clap::Args;
use faceoff_metrics::Metrics;
use faceoff_sandbox::probe_host;
use faceoff_types::is_harmless;
use faceoff_wire::remote::Introduction;
use faceoff_worker::{CpuLayout, RemoteWorker, SlotThreads, SlotsConfig};
use jiff::SignedDuration;
use std::{
    fs,
    io::{self, Write as _},
    os::unix::fs::OpenOptionsExt as _,
    path::{Path, PathBuf},
};
use tokio_util::sync::CancellationToken;

/// Plays for a server on another machine.
///
/// Takes what the server gives out by NATS: episodes and games. It needs this very program, the runtimes that the server offers, and a
/// host that can isolate agents as the server's; it needs no data folder and learns no secret. SIGTERM gives back what is under way.
#[derive(Debug, Args)]
pub struct WorkerCommand {
    /// Configuration file [default: faceoff.toml in the working folder, if there is one]; of it, [nats], [workers], [sandbox] and
    /// [runtimes] matter
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// Where NATS is; replaces nats.url of the configuration
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// What this worker is called [default: the host's name]
    #[arg(long)]
    name: Option<String>,
    /// Units of work at the same time; replaces workers.slots of the configuration
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// What organisers see beside its name, as "lab 3,borrowed"; up to 8
    #[arg(long, value_name = "TEXT,…", value_delimiter = ',', value_parser = label)]
    labels: Vec<String>,
    /// Folder for what is under way, of this worker alone; replaces workers.scratch_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    scratch_dir: Option<PathBuf>,
    /// Ends once no slot has had anything to do for so long, as 10m; left out, it goes on
    #[arg(long, value_name = "TIME")]
    drain_after_idle: Option<SignedDuration>,
    /// Makes a key by which NATS knows a server or a worker, keeps its secret half in FILE, for nats.nkey_file, prints the other half
    /// for NATS' configuration, and ends
    #[arg(long, value_name = "FILE")]
    make_key: Option<PathBuf>,
    /// How the log is written, to standard error; RUST_LOG sets what is logged
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

impl WorkerCommand {
    /// Works until SIGINT or SIGTERM.
    ///
    /// # Errors
    /// If the configuration, the scratch folder or the sandbox is not as it must be.
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(file) = &self.make_key {
            return make_key(file);
        }
        self.log_format.start()?;
        let mut config = Config::load(self.config.as_deref())?;
        config.reach_nats(self.nats)?;
        if let Some(slots) = self.slots {
            config.have_slots(slots)?;
        }
        if let Some(scratch_dir) = self.scratch_dir {
            config.workers.scratch_dir = Some(scratch_dir);
        }
        let nats = config.nats.connection().ok_or_else(|| {
            anyhow!("no NATS is named: give --nats nats://HOST:4222, or set nats.url in the configuration")
        })?;
        let name = match self.name {
            Some(name) => name,
            None => host_name()?,
        };
        check_sandbox(&probe_host(), &config.sandbox.given_up)?;
        config.check_runtimes()?;
        let mut agent = config.agent_environment();
        let mut own = introduction(&agent, config.slots())?;
        anyhow::ensure!(
            self.labels.len() <= Introduction::MOST_LABELS,
            "--labels: expected at most {}, got {}",
            Introduction::MOST_LABELS,
            self.labels.len()
        );
        own.labels = self.labels;
        let http = files_client(config.nats.ca_file.as_deref())?;
        // For as long as agents run.
        let _image = in_memory(&mut agent.runtimes, config.sandbox.resident_bytes);
        let scratch_dir = config.scratch_dir();
        fs::create_dir_all(&scratch_dir)
            .with_context(|| format!("making the folder {}", scratch_dir.display()))?;
        let worker = RemoteWorker {
            nats,
            name,
            own,
            http,
            ends_after: self.drain_after_idle.map(SignedDuration::unsigned_abs),
            slots: SlotsConfig {
                cpus: CpuLayout::of_a_server(config.slots(), &config.workers.agent_cpus),
                threads: SlotThreads::of_the_caller(),
                scratch_dir,
                agent,
                metrics: Metrics::new(env!("CARGO_PKG_VERSION")),
            },
        };
        tracing::info!(
            name = worker.name,
            slots = worker.slots.cpus.slots.len(),
            nats = worker.nats.url,
            "working"
        );
        tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()
            .context("starting the async runtime")?
            .block_on(work(worker))
    }
}

async fn work(worker: RemoteWorker) -> anyhow::Result<()> {
    let shutdown = CancellationToken::new();
    let mut working = tokio::spawn(faceoff_worker::work(worker, shutdown.clone()));
    let signal = super::serve::signalled()?;
    tokio::select! {
        name = signal => tracing::info!(signal = name, "ending: slots give their work back"),
        ended = &mut working => return ended.context("the worker panicked")?,
    }
    shutdown.cancel();
    let second = super::serve::signalled()?;
    tokio::select! {
        ended = working => ended.context("the worker panicked")?,
        name = second => {
            tracing::warn!(signal = name, "ending at once");
            Ok(())
        }
    }
}

/// Keeps the secret half, which nobody but its owner can read, and prints the other.
fn make_key(file: &Path) -> anyhow::Result<()> {
    let key = nkeys::KeyPair::new_user();
    let seed = key.seed().context("making a key")?;
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

/// A label that a page shows as it is.
fn label(text: &str) -> Result<String, String> {
    let chars = text.chars().count();
    let most = Introduction::LONGEST_LABEL;
    if (1..=most).contains(&chars) && text.chars().all(is_harmless) {
        return Ok(text.to_owned());
    }
    Err(format!(
        "expected 1 to {most} characters, none of them invisible"
    ))
}

/// This host's name, as subjects can have it.
pub(super) fn host_name() -> anyhow::Result<String> {
    let name = rustix::system::uname();
    let name = name.nodename().to_string_lossy();
    let word: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    anyhow::ensure!(
        !word.is_empty(),
        "this host has no name; choose one with --name"
    );
    Ok(word)
}
