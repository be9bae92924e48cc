use crate::{
    artifacts::Artifacts, boxed, database::Database, error::Result, event::Change, live::LiveGames,
    pulse::Pulse, room::Room, schema::Upgrade, signals::Signals, tables::archived::Archived,
    workers::Workers,
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
    pub(crate) room: Arc<Room>,
    pub(crate) pulse: Arc<Pulse>,
    pub(crate) live: LiveGames,
    pub(crate) workers: Workers,
    pub(crate) archived: Option<Arc<Archived>>,
}

impl Store {
    /// With other disks to watch, or more to keep free, than nothing of the data folder's.
    #[must_use]
    pub fn with_room(self, room: Room) -> Self {
        Self {
            room: Arc::new(room),
            ..self
        }
    }

    /// Is there room for more work and uploads? The store stores what it is given; workers and the web
    /// side ask.
    #[must_use]
    pub fn room(&self) -> &Room {
        &self.room
    }

    /// The season is an archive's and never changes, if it is.
    #[must_use]
    pub fn archived(&self) -> Option<&Archived> {
        self.archived.as_deref()
    }

    /// The database was of an earlier version when this handle opened it.
    #[must_use]
    pub const fn upgrade(&self) -> Option<&Upgrade> {
        self.database.upgrade.as_ref()
    }

    /// Copies the database's log into the database, as far as nobody must wait for it. Run it now and
    /// then; a log that grows too long is emptied without it.
    #[boxed]
    pub async fn checkpoint(&self) -> Result<()> {
        self.database.checkpoint().await
    }

    /// Bundles, recordings and datasets.
    #[must_use]
    pub const fn artifacts(&self) -> &Artifacts {
        &self.artifacts
    }

    /// Games as this process's slots play them.
    #[must_use]
    pub const fn live_games(&self) -> &LiveGames {
        &self.live
    }

    /// Workers on other machines, as this process hears of them.
    #[must_use]
    pub const fn workers(&self) -> &Workers {
        &self.workers
    }

    /// What changes from now on, of this process's doing, told after the commit. A receiver that falls
    /// behind loses the oldest and is told so (`Lagged`): it reads [`Store::events_after`] from the
    /// last id that it has seen, which also has what other processes wrote.
    #[must_use]
    pub fn events(&self) -> broadcast::Receiver<Change> {
        self.signals.changes()
    }

    /// How often this process has changed the season so far: what was read before is as good as new while that stays.
    #[must_use]
    pub fn changes_made(&self) -> u64 {
        self.signals.made()
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
    #[boxed]
    pub async fn close(&self) {
        self.database.close().await;
    }
}
