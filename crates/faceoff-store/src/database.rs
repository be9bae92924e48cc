use crate::{
    error::{Result, StoreError},
    log::{LOG_BOUND_BYTES, Log},
    schema::{self, MIGRATIONS, Upgrade},
};
use futures::future::BoxFuture;
use sqlx::{
    Connection, Sqlite, SqliteConnection, SqlitePool, Transaction,
    pool::PoolConnectionMetadata,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous},
};
use std::{path::Path, sync::Arc, time::Duration};

/// How long a writer waits for the writer of another process.
pub(crate) const BUSY_TIMEOUT: Duration = Duration::from_secs(30);

/// Readers at a time; a board is read in well under a millisecond.
pub(crate) const READERS: u32 = 4;

/// May a connection that comes back be used again? SQLite rolls back by itself when the disk is full. The
/// library's own rollback fails then, it believes in the transaction for good, and no other can begin:
/// such a connection is replaced.
fn is_sound(
    connection: &mut SqliteConnection,
    _: PoolConnectionMetadata,
) -> BoxFuture<'_, sqlx::Result<bool>> {
    Box::pin(async move {
        // after the rollback that a dropped transaction has sent ahead
        connection.ping().await?;
        Ok(!connection.is_in_transaction())
    })
}

/// The pools: readers see the last committed state and never wait for the writer.
#[derive(Debug, Clone)]
pub(crate) struct Database {
    pub(crate) read: SqlitePool,
    pub(crate) write: SqlitePool,
    pub(crate) file: Arc<Path>,
    pub(crate) log: Arc<Log>,
    /// What opening it has changed.
    pub(crate) upgrade: Option<Upgrade>,
}

impl Database {
    /// Opens and migrates the file, creating it if need be. The caller makes sure that no other
    /// process does the same at the same time: SQLite has no lock for a set of migrations.
    pub(crate) async fn open(file: &Path) -> Result<Self> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Wal)
            // NORMAL would survive kill -9 too, but a power cut could take back a commit that a
            // team was told of. Writes are a few per second, so the fsync costs nothing that shows.
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(BUSY_TIMEOUT)
            // what is left of the log's file when SQLite starts it anew
            .pragma("journal_size_limit", LOG_BOUND_BYTES.to_string())
            // a read that sorts must not fail for want of disk
            .pragma("temp_store", "MEMORY");
        let write = SqlitePoolOptions::new()
            .max_connections(1)
            // writers queue here rather than in SQLite's polling busy handler
            .acquire_timeout(2 * BUSY_TIMEOUT)
            .after_release(is_sound)
            .connect_with(options.clone())
            .await?;
        let before = schema::before(&mut *write.acquire().await?).await?;
        MIGRATIONS
            .run(&write)
            .await
            .map_err(|error| StoreError::Database(error.into()))?;
        let upgrade = schema::after(&mut *write.acquire().await?, before).await?;
        let read = SqlitePoolOptions::new()
            .max_connections(READERS)
            .after_release(is_sound)
            .connect_with(options.create_if_missing(false).pragma("query_only", "ON"))
            .await?;
        let mut log = file.as_os_str().to_owned();
        log.push("-wal");
        Ok(Self {
            read,
            write,
            file: file.into(),
            log: Arc::new(Log::new(log.into())),
            upgrade,
        })
    }

    /// Begins a write. IMMEDIATE: a transaction that reads first and asks for the write lock later
    /// fails at once, whatever the busy timeout, if another wrote in between.
    pub(crate) async fn begin(&self) -> Result<Transaction<'static, Sqlite>> {
        Ok(self.write.begin_with("BEGIN IMMEDIATE").await?)
    }

    /// Writes what changes nothing, to the disk, as every commit does.
    pub(crate) async fn probe_write(&self) -> Result<()> {
        let mut transaction = self.begin().await?;
        // Nobody uses this number; setting it writes a page even if it stays the same.
        sqlx::query("PRAGMA user_version = 0")
            .execute(&mut *transaction)
            .await?;
        Ok(transaction.commit().await?)
    }

    /// Waits for running queries and closes every connection.
    pub(crate) async fn close(&self) {
        self.read.close().await;
        self.write.close().await;
    }
}
