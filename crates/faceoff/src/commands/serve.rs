//! `faceoff serve`: API, pages, worker slots and schedule in one process. A *slot* runs one job at a time, e.g. the episodes of an
//! agent or a game; the *schedule* starts evaluation days. A season is *live*, or *archived* and shown read-only. `resources` are
//! what both open first, `tasks` the parts of a live server that run until the shutdown, and `priority` keeps requests from
//! disturbing slots.

mod archived_season;
mod clock;
mod data_folder;
mod downloads;
mod expired_uploads;
mod http;
mod live_season;
mod monitoring;
mod priority;
mod remote;
mod resources;
mod runtime_inventory;
mod sandbox;
mod tasks;

pub use data_folder::{ADMIN_TOKEN_FILE, lock};
pub use http::shutdown_signal;
pub use sandbox::{check_sandbox, copy_to_memory};

use super::config_file::ConfigFile;
use crate::{config::Config, descriptors::Descriptors, log::LogFormat};
use anyhow::Context;
use clap::Args;
use faceoff_http::ConnectionLimits;
use faceoff_sandbox::probe_host;
use faceoff_store::{ArchivedSeason, Store};
use rustix::fs::Mode;
use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

/// Starts the competition server.
#[derive(Debug, Args)]
pub struct ServeCommand {
    #[command(flatten)]
    config: ConfigFile,
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
        // Other users of the host may not read what the server writes. Files that agents read get other modes explicitly.
        rustix::process::umask(Mode::RWXG | Mode::RWXO);
        let config = self.load_config()?;
        let archived = super::block_on(archived_season(&config.server.data_dir))?;
        if archived.is_none() {
            // Checked before anything is opened: a host that cannot isolate agents must not look as if it could.
            check_sandbox(&probe_host(), &config.sandbox.given_up)?;
            config.check_runtimes()?;
        }
        let connections = assign_descriptors(&config)?;
        match archived {
            // An archived season runs no agents, so no CPUs are reserved.
            Some(archived) => {
                super::block_on_all_cpus(archived_season::serve(config, connections, archived))
            }
            None => live_season::run(config, connections),
        }
    }

    /// The configuration with the options of the command line.
    fn load_config(self) -> anyhow::Result<Config> {
        let mut config = self.config.load()?;
        if let Some(listen) = self.listen {
            config.server.listen = listen;
        }
        if let Some(data_dir) = self.data_dir {
            config.server.data_dir = data_dir;
        }
        config.override_nats_url(self.nats)?;
        Ok(config)
    }
}

/// The archive in the data folder, if `faceoff import` has created the folder.
async fn archived_season(data_dir: &Path) -> anyhow::Result<Option<ArchivedSeason>> {
    let archived = Store::archived_in(data_dir).await;
    archived.with_context(|| format!("reading the data folder {}", data_dir.display()))
}

/// Divides the file descriptors of this process among slots and connections; returns the limits of connections.
fn assign_descriptors(config: &Config) -> anyhow::Result<ConnectionLimits> {
    let requested = config.connections.limits();
    let descriptors = Descriptors::divide(Descriptors::raise(), config.slots(), &requested)?;
    tracing::info!(
        limit = descriptors.limit,
        reserved = descriptors.reserved,
        connections = descriptors.connections,
        per_address = descriptors.per_address,
        "file descriptors assigned"
    );
    if descriptors.connections < requested.open {
        tracing::warn!(
            wanted = requested.open,
            "fewer connections than connections.most: raise the limit of file descriptors (ulimit -n, LimitNOFILE=)"
        );
    }
    Ok(descriptors.limits(requested))
}
