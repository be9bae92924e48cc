use crate::{Artifacts, Event, StoreError, database::Database, events::Signals, season};
use std::{fs::File, path::Path, sync::Arc};
use tokio::sync::{broadcast, watch};

/// Handle to the database and the artifacts of one data folder. Cloning is cheap. Several processes
/// may open the same folder.
#[derive(Debug, Clone)]
pub struct Store {
    pub(crate) database: Database,
    pub(crate) signals: Arc<Signals>,
    artifacts: Artifacts,
}

impl Store {
    /// Opens `data_dir/faceoff.sqlite3` and `data_dir/artifacts`, creating and migrating them as
    /// needed, and draws the season's secret on the first time.
    pub async fn open(data_dir: &Path) -> Result<Self, StoreError> {
        // Two processes that start together must not both migrate.
        let _opening = lock_folder(data_dir.to_owned()).await?;
        let artifacts = Artifacts::open(&data_dir.join("artifacts"))?;
        let database = Database::open(&data_dir.join("faceoff.sqlite3")).await?;
        season::draw_secret_once(&database).await?;
        Ok(Self {
            database,
            signals: Arc::new(Signals::new()),
            artifacts,
        })
    }

    /// Bundles, recordings and datasets.
    #[must_use]
    pub const fn artifacts(&self) -> &Artifacts {
        &self.artifacts
    }

    /// Hints of what changed, from now on.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Event> {
        self.signals.events()
    }

    /// Changes whenever this process adds work to the queue. Look at the value before claiming and
    /// wait for its change after an empty claim: nothing can be missed in between. Units that become
    /// claimable by the passing of time (an expired lease, the end of a back-off) send nothing.
    #[must_use]
    pub fn work_signal(&self) -> watch::Receiver<u64> {
        self.signals.work()
    }

    /// Waits for running queries and closes the database. Dropping the handle is as safe, but does
    /// not wait.
    pub async fn close(&self) {
        self.database.close().await;
    }
}

/// Creates the folder and holds its lock until the file is dropped (or the process dies).
async fn lock_folder(data_dir: std::path::PathBuf) -> Result<File, StoreError> {
    let lock = move || {
        std::fs::create_dir_all(&data_dir)?;
        let file = File::create(data_dir.join("faceoff.lock"))?;
        file.lock()?;
        Ok(file)
    };
    tokio::task::spawn_blocking(lock)
        .await
        .unwrap_or_else(|panic| Err(std::io::Error::other(panic)))
        .map_err(|error| StoreError::Database(sqlx::Error::Io(error)))
}
