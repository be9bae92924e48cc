//! [`Store`]: the handle through which all other crates use this one.

use crate::{
    artifacts::Artifacts, boxed_future, database::Database, error::Result, event::Change,
    free_space::FreeSpace, health_probes::HealthProbes, schema::Upgrade, signals::Signals,
    tables::archive::ArchivedSeason,
};
use std::sync::Arc;
use tokio::sync::{broadcast, watch};

/// Handle to the database and the artifacts of one data folder. Cloning is cheap. Several processes
/// may open the same folder.
#[derive(Debug, Clone)]
pub struct Store {
    pub(crate) database: Database,
    pub(crate) signals: Arc<Signals>,
    pub(crate) artifacts: Artifacts,
    pub(crate) free_space: Arc<FreeSpace>,
    /// The latest poll of a worker and the latest test write of the database, for the health report.
    pub(crate) probes: Arc<HealthProbes>,
    /// Set if the season was imported from an archive.
    pub(crate) archive: Option<Arc<ArchivedSeason>>,
}

impl Store {
    /// Sets which disks to watch and how much to keep free on them. By default nothing is watched.
    #[must_use]
    pub fn with_free_space(self, free_space: FreeSpace) -> Self {
        Self {
            free_space: Arc::new(free_space),
            ..self
        }
    }

    /// Free disk space for more jobs and uploads. The store itself does not check it; workers and the
    /// server do.
    #[must_use]
    pub fn free_space(&self) -> &FreeSpace {
        &self.free_space
    }

    /// The archive from which the season was imported, if it was. Such a season is read-only.
    #[must_use]
    pub fn archived_season(&self) -> Option<&ArchivedSeason> {
        self.archive.as_deref()
    }

    /// The migration that opening this handle has run, if the database was of an earlier version.
    #[must_use]
    pub const fn upgrade(&self) -> Option<&Upgrade> {
        self.database.upgrade.as_ref()
    }

    /// Copies the write-ahead log into the database, as far as possible without blocking. Run it
    /// periodically; a log that grows too long is emptied without it.
    #[boxed_future]
    pub async fn checkpoint(&self) -> Result<()> {
        self.database.checkpoint().await
    }

    /// Runs a future, for example the handler of a page, all of whose reads see the same state of the database. Its writes, and
    /// reads in tasks that it spawns, are not included. It must not read what it has written itself. While very many such futures
    /// run at once, further ones read one by one instead of waiting.
    pub async fn read_consistently<T>(&self, reads: impl Future<Output = T>) -> T {
        self.database.read.consistent(reads).await
    }

    /// The object store of bundles, recordings and datasets.
    #[must_use]
    pub const fn artifacts(&self) -> &Artifacts {
        &self.artifacts
    }

    /// Changes that this process makes from now on, sent after the commit. A receiver that falls
    /// behind loses the oldest and gets `Lagged`. It then reads [`Store::events_after`] from the
    /// last id that it has seen, which also includes what other processes wrote.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Change> {
        self.signals.changes()
    }

    /// Number of changes of the season by this process so far. While it is the same, the results of earlier queries are
    /// current.
    #[must_use]
    pub fn change_count(&self) -> u64 {
        self.signals.commits()
    }

    /// Changes whenever this process adds a job to the queue. Read the value before claiming and
    /// wait for its change after an empty claim: nothing can be missed in between. Jobs that become
    /// claimable with time (an expired lease, the end of a back-off) send nothing.
    #[must_use]
    pub fn job_signal(&self) -> watch::Receiver<u64> {
        self.signals.jobs()
    }

    /// Waits for running queries and closes the database. Dropping the handle is as safe, but does
    /// not wait.
    #[boxed_future]
    pub async fn close(&self) {
        self.database.close().await;
    }
}
