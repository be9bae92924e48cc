//! The connections that only read. Each read takes one, unless it belongs to a group of reads that see the same state
//! ([`Readers::consistent`]).

use sqlx::{
    Sqlite, SqliteConnection, SqlitePool, Transaction,
    pool::PoolConnection,
    sqlite::{SqliteConnectOptions, SqlitePoolOptions},
};
use std::{
    ops::{Deref, DerefMut},
    path::Path,
    sync::Arc,
};
use tokio::sync::{Mutex, OwnedMappedMutexGuard, OwnedMutexGuard, OwnedSemaphorePermit, Semaphore};

/// Number of connections for single reads. Few are enough: a query takes well under a millisecond.
const SINGLE_READS: u32 = 4;

/// Number of connections for groups of reads. A group keeps its connection longer, for example while a page waits for a
/// computation between two reads.
const READ_GROUPS: u32 = 16;

tokio::task_local! {
    /// The group to which the reads of the current task belong.
    static GROUP: ReadGroup;
}

/// Reads that share one transaction.
#[derive(Debug, Clone)]
struct ReadGroup {
    /// The database; a task may read others as well.
    file: Arc<Path>,
    state: Arc<Mutex<GroupState>>,
}

/// A group begins with its first read.
#[derive(Debug, Default)]
pub(crate) enum GroupState {
    #[default]
    NotBegun,
    Begun {
        transaction: Transaction<'static, Sqlite>,
        /// Counts the transaction.
        _permit: OwnedSemaphorePermit,
    },
    /// All connections for groups were in use: its reads are single ones.
    Ungrouped,
}

/// The read connections of a database.
#[derive(Debug, Clone)]
pub(crate) struct Readers {
    file: Arc<Path>,
    /// Connections for single reads.
    single: SqlitePool,
    /// Connections for groups of reads. They are separate, because a group keeps its connection while it waits for other tasks,
    /// which need one for themselves.
    groups: SqlitePool,
    /// One permit per connection for groups.
    group_permits: Arc<Semaphore>,
}

/// All connections that a process can read with; while they are held, no read of the process is running.
pub(crate) struct AllReaders {
    _single: Vec<PoolConnection<Sqlite>>,
    _groups: OwnedSemaphorePermit,
}

impl Readers {
    /// Connects to the database in `file`.
    pub(crate) async fn connect(
        file: Arc<Path>,
        pool: impl Fn(u32) -> SqlitePoolOptions,
        options: SqliteConnectOptions,
    ) -> sqlx::Result<Self> {
        Ok(Self {
            file,
            single: pool(SINGLE_READS).connect_with(options.clone()).await?,
            // Connects with the first group: many programs open a store without one.
            groups: pool(READ_GROUPS).connect_lazy_with(options),
            group_permits: Arc::new(Semaphore::new(READ_GROUPS as usize)),
        })
    }

    /// Waits for running reads and keeps others from starting.
    pub(crate) async fn all(&self) -> sqlx::Result<AllReaders> {
        // Groups first: one that has begun may wait for a task that needs a connection for a single read.
        let groups = Arc::clone(&self.group_permits).acquire_many_owned(READ_GROUPS);
        let groups = groups.await.map_err(|_| sqlx::Error::PoolClosed)?;
        let mut single = Vec::with_capacity(SINGLE_READS as usize);
        for _ in 0..SINGLE_READS {
            single.push(self.single.acquire().await?);
        }
        Ok(AllReaders {
            _single: single,
            _groups: groups,
        })
    }

    /// A connection for one read.
    pub(crate) async fn acquire(&self) -> sqlx::Result<ReadConnection> {
        match self.in_group().await? {
            Some(connection) => Ok(connection),
            None => Ok(ReadConnection::Single(self.single.acquire().await?)),
        }
    }

    /// A connection for several reads that see the same state.
    pub(crate) async fn begin(&self) -> sqlx::Result<ReadConnection> {
        match self.in_group().await? {
            Some(connection) => Ok(connection),
            None => Ok(ReadConnection::Transaction(self.single.begin().await?)),
        }
    }

    /// Runs a future, all of whose reads see the same state of this database, unless all connections for groups are in use. Reads
    /// in tasks that it spawns are not included.
    pub(crate) async fn consistent<T>(&self, reads: impl Future<Output = T>) -> T {
        let group = ReadGroup {
            file: Arc::clone(&self.file),
            state: Arc::default(),
        };
        GROUP.scope(group, reads).await
    }

    /// The connection of the current task's group; `None` if it is in none, or the group has no connection.
    async fn in_group(&self) -> sqlx::Result<Option<ReadConnection>> {
        let group = GROUP.try_with(ReadGroup::clone).ok();
        let Some(group) = group.filter(|group| Arc::ptr_eq(&group.file, &self.file)) else {
            return Ok(None);
        };
        let mut state = group.state.lock_owned().await;
        if let GroupState::NotBegun = *state {
            *state = match Arc::clone(&self.group_permits).try_acquire_owned() {
                Ok(permit) => GroupState::Begun {
                    transaction: self.groups.begin().await?,
                    _permit: permit,
                },
                Err(_) => GroupState::Ungrouped,
            };
        }
        let connection = OwnedMutexGuard::try_map(state, |state| match state {
            GroupState::Begun { transaction, .. } => Some(transaction),
            GroupState::NotBegun | GroupState::Ungrouped => None,
        });
        Ok(connection.ok().map(ReadConnection::Group))
    }

    /// Waits for running reads and closes the connections.
    pub(crate) async fn close(&self) {
        self.single.close().await;
        self.groups.close().await;
    }
}

/// A connection that can only read. A task that holds one must not ask for another: in a group it would wait for itself.
pub(crate) enum ReadConnection {
    Single(PoolConnection<Sqlite>),
    Transaction(Transaction<'static, Sqlite>),
    Group(OwnedMappedMutexGuard<GroupState, Transaction<'static, Sqlite>>),
}

impl Deref for ReadConnection {
    type Target = SqliteConnection;

    fn deref(&self) -> &SqliteConnection {
        match self {
            Self::Single(connection) => connection,
            Self::Transaction(connection) => connection,
            Self::Group(connection) => connection,
        }
    }
}

impl DerefMut for ReadConnection {
    fn deref_mut(&mut self) -> &mut SqliteConnection {
        match self {
            Self::Single(connection) => connection,
            Self::Transaction(connection) => connection,
            Self::Group(connection) => connection,
        }
    }
}
