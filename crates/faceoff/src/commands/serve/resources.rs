//! The resources of a server, of a running or an archived season: the locked data folder with the opened database, the bound address and
//! the HTTP settings.

use super::{
    clock::server_clock,
    data_folder::{
        close_to_others, empty_folder_except, load_or_create_link_key, lock,
        register_operator_token,
    },
    downloads::downloads,
};
use crate::competition::{competition, simulator};
use crate::{config::Config, machine};
use anyhow::{Context, anyhow};
use faceoff_http::{
    AgentResources, Capacity, Downloads, HttpConfig, LinkKey, PARTIAL_UPLOADS_FOLDER,
};
use faceoff_metrics::Metrics;
use faceoff_store::{FreeSpace, Store};
use faceoff_types::Clock;
use std::{
    fs::File,
    io::Write as _,
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::Arc,
};
use tokio::net::TcpListener;

/// The resources that the server opens before it accepts connections, and keeps until it ends.
pub(super) struct ServerResources {
    pub(super) store: Store,
    pub(super) listener: TcpListener,
    pub(super) address: SocketAddr,
    /// Signs download links and the grants of remote workers.
    pub(super) link_key: LinkKey,
    pub(super) clock: Clock,
    pub(super) upload_dir: PathBuf,
    /// The files of the page `/downloads`.
    downloads: Arc<Downloads>,
    /// The lock of the data folder, held as long as the season is served.
    _lock: File,
}

impl ServerResources {
    /// Locks and opens the existing data folder and binds the address. `disks` are folders on the disks whose free space is
    /// watched.
    ///
    /// # Errors
    /// If the data folder or the address is unusable.
    pub(super) async fn open(config: &Config, disks: Vec<PathBuf>) -> anyhow::Result<Self> {
        let data_dir = &config.server.data_dir;
        let lock = lock(data_dir)?;
        let upload_dir = data_dir.join("uploads");
        // A process that was killed may have left half-uploaded files, which belong to no submission, or an archive that a
        // visitor was downloading. Partial uploads continue after a restart.
        empty_folder_except(&upload_dir, PARTIAL_UPLOADS_FOLDER)?;
        let store = open_store(data_dir)
            .await?
            .with_free_space(FreeSpace::new(disks, config.server.min_free_bytes));
        // Before any change of the database, because the clock is compared with the time of the newest change.
        let clock = server_clock(data_dir, &store).await?;
        // After the database and the folder of artifacts exist.
        close_to_others(data_dir)?;
        // A data folder belongs to one competition: the first start binds it, later starts compare.
        let checked = competition().check();
        checked.map_err(|problem| anyhow!("the competition of this program: {problem}"))?;
        let bound = store.bind_competition(competition(), clock.now()).await;
        bound.with_context(|| format!("opening the data folder {}", data_dir.display()))?;
        register_operator_token(&store, data_dir, clock.now()).await?;
        let listen = config.server.listen;
        let listener = TcpListener::bind(listen).await.with_context(|| {
            format!("listening on {listen}; choose another address with --listen")
        })?;
        Ok(Self {
            store,
            address: listener.local_addr().context("reading the bound address")?,
            listener,
            link_key: load_or_create_link_key(data_dir)?,
            clock,
            upload_dir,
            downloads: Arc::new(downloads(config.server.downloads_dir.as_deref())?),
            _lock: lock,
        })
    }

    /// The settings of API and pages.
    pub(super) fn http_config(
        &self,
        config: &Config,
        clock: Clock,
        capacity: Capacity,
        agent_resources: AgentResources,
    ) -> HttpConfig {
        HttpConfig {
            simulator: simulator(),
            max_bundle_bytes: config.bundle.packed_bytes,
            downloads: self.downloads.clone(),
            source_url: config.server.source_url.clone(),
            public_url: config.server.public_url.clone(),
            upload_dir: self.upload_dir.clone(),
            clock,
            limits: config.uploads.limits(),
            capacity,
            agent_resources,
            webhooks: config.webhooks.clone(),
            rate_limits: config.rates.limits(),
            link_key: self.link_key.clone(),
            metrics: Metrics::new(env!("CARGO_PKG_VERSION")),
            process: machine::process,
        }
    }
}

async fn open_store(data_dir: &Path) -> anyhow::Result<Store> {
    let store = Store::open(data_dir).await;
    store.with_context(|| format!("opening the data folder {}", data_dir.display()))
}

/// Prints the address, including a port that the system has chosen, once connections are accepted, so that the parent process
/// can read it. A closed standard output is no error.
pub(super) fn print_address(address: SocketAddr) {
    let _ = writeln!(std::io::stdout(), "http://{address}");
}
