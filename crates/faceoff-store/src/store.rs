use crate::{artifacts::Artifacts, database::Database, event::Change, signals::Signals};
use std::sync::Arc;
use tokio::sync::{broadcast, watch};

/// Handle to the database and the artifacts of one data folder. Cloning is cheap. Several processes
/// may open the same folder.
#[derive(Debug, Clone)]
pub struct Store {
    pub(crate) database: Database,
    pub(crate) signals: Arc<Signals>,
    pub(crate) artifacts: Artifacts,
}

impl Store {
    /// Bundles, recordings and datasets.
    #[must_use]
    pub const fn artifacts(&self) -> &Artifacts {
        &self.artifacts
    }

    /// What changes from now on, of this process's doing, told after the commit. A receiver that falls
    /// behind loses the oldest and is told so (`Lagged`): it reads [`Store::events_after`] from the
    /// last id that it has seen, which also has what other processes wrote.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Change> {
        self.signals.changes()
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
