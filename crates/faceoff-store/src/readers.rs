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

/// Reads that share one transaction. It begins with the first of them.
#[derive(Debug, Clone)]
struct ReadGroup {
    /// The database; a task may read others as well.
    file: Arc<Path>,
    transaction: Arc<Mutex<Option<GroupTransaction>>>,
}

/// The transaction of a group, with the permit that counts it.
#[derive(Debug)]
pub(crate) struct GroupTransaction {
    transaction: Transaction<'static, Sqlite>,
    _permit: OwnedSemaphorePermit,
}

/// The read connections of a database.
#[derive(Debug, Clone)]
pub(crate) struct Readers {
    file: Arc<Path>,
    /// Connections for single reads.
    single: SqlitePool,
    /// Connections for groups of reads. They are separate, because a group keeps its connection while it waits for other tasks,
    /// which may need one for themselves.
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
        let mut single = Vec::with_capacity(SINGLE_READS as usize);
        for _ in 0..SINGLE_READS {
            single.push(self.single.acquire().await?);
        }
        Ok(AllReaders {
            _single: single,
            _groups: self.group_permit(READ_GROUPS).await?,
        })
    }

    /// A connection for one read.
    pub(crate) async fn acquire(&self) -> sqlx::Result<ReadConnection> {
        match self.group() {
            Some(group) => self.in_group(group).await,
            None => Ok(ReadConnection::Single(self.single.acquire().await?)),
        }
    }

    /// A connection for several reads that see the same state.
    pub(crate) async fn begin(&self) -> sqlx::Result<ReadConnection> {
        match self.group() {
            Some(group) => self.in_group(group).await,
            None => Ok(ReadConnection::Transaction(self.single.begin().await?)),
        }
    }

    /// Runs a future, all of whose reads see the same state of this database. Reads in tasks that it spawns are not included.
    pub(crate) async fn consistent<T>(&self, reads: impl Future<Output = T>) -> T {
        let group = ReadGroup {
            file: Arc::clone(&self.file),
            transaction: Arc::default(),
        };
        GROUP.scope(group, reads).await
    }

    fn group(&self) -> Option<ReadGroup> {
        let group = GROUP.try_with(ReadGroup::clone).ok();
        group.filter(|group| Arc::ptr_eq(&group.file, &self.file))
    }

    async fn in_group(&self, group: ReadGroup) -> sqlx::Result<ReadConnection> {
        let mut transaction = group.transaction.lock_owned().await;
        if transaction.is_none() {
            let permit = self.group_permit(1).await?;
            *transaction = Some(GroupTransaction {
                transaction: self.groups.begin().await?,
                _permit: permit,
            });
        }
        let connection = OwnedMutexGuard::try_map(transaction, |begun| {
            begun.as_mut().map(|group| &mut group.transaction)
        });
        connection
            .map(ReadConnection::Group)
            .map_err(|_| sqlx::Error::PoolClosed)
    }

    async fn group_permit(&self, count: u32) -> sqlx::Result<OwnedSemaphorePermit> {
        let permits = Arc::clone(&self.group_permits).acquire_many_owned(count);
        permits.await.map_err(|_| sqlx::Error::PoolClosed)
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
    Group(OwnedMappedMutexGuard<Option<GroupTransaction>, Transaction<'static, Sqlite>>),
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
