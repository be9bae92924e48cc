//! The SQLite database of a data folder: the pools of its connections, and how they are opened.

use crate::{
    error::Result,
    readers::Readers,
    schema::{self, MIGRATIONS, Upgrade},
    write_ahead_log::{MAX_LOG_BYTES, WriteAheadLog},
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

/// May a released connection be used again? SQLite rolls back automatically when the disk is full. The rollback
/// of the library sqlx then fails: on that connection sqlx believes forever that the transaction is open, so that no
/// other can begin. Such a connection is replaced.
fn is_reusable(
    connection: &mut SqliteConnection,
    _: PoolConnectionMetadata,
) -> BoxFuture<'_, sqlx::Result<bool>> {
    Box::pin(async move {
        // waits for the rollback that a dropped transaction has queued
        connection.ping().await?;
        Ok(!connection.is_in_transaction())
    })
}

/// The connection pools. Readers see the last committed state and never wait for the writer.
#[derive(Debug, Clone)]
pub(crate) struct Database {
    /// Connections that can only read.
    pub(crate) read: Readers,
    /// The only connection that can write.
    pub(crate) write: SqlitePool,
    pub(crate) file: Arc<Path>,
    pub(crate) log: Arc<WriteAheadLog>,
    /// The migration that was run on opening, if any.
    pub(crate) upgrade: Option<Upgrade>,
}

impl Database {
    /// Opens and migrates the file, creating it if necessary. The caller makes sure that no other
    /// process does so at the same time: SQLite has no lock for a set of migrations.
    pub(crate) async fn open(file: &Path) -> Result<Self> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Wal)
            // NORMAL would survive kill -9 too, but a power cut could undo a commit that was already
            // confirmed to a team. With a few writes per second the fsync costs nothing measurable.
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(BUSY_TIMEOUT)
            // size to which SQLite truncates the log file when it restarts the log
            .pragma("journal_size_limit", MAX_LOG_BYTES.to_string())
            // a read that sorts must not fail on a full disk
            .pragma("temp_store", "MEMORY");
        let write = SqlitePoolOptions::new()
            .max_connections(1)
            // writers queue here rather than in SQLite's polling busy handler
            .acquire_timeout(2 * BUSY_TIMEOUT)
            .after_release(is_reusable)
            .connect_with(options.clone())
            .await?;
        let schema_before = schema::check_migratable(&mut *write.acquire().await?).await?;
        MIGRATIONS.run(&write).await?;
        let upgrade = schema::record_program(&mut *write.acquire().await?, schema_before).await?;
        let read_options = options.create_if_missing(false).pragma("query_only", "ON");
        let pool = |connections| {
            SqlitePoolOptions::new()
                .max_connections(connections)
                .after_release(is_reusable)
        };
        let file: Arc<Path> = file.into();
        let read = Readers::connect(Arc::clone(&file), pool, read_options).await?;
        let mut log_file = file.as_os_str().to_owned();
        log_file.push("-wal");
        Ok(Self {
            read,
            write,
            file,
            log: Arc::new(WriteAheadLog::new(log_file.into())),
            upgrade,
        })
    }

    /// Begins a write transaction. It is IMMEDIATE: a transaction that takes the write lock only after a
    /// read fails at once if another wrote in between, regardless of the busy timeout.
    pub(crate) async fn begin(&self) -> Result<Transaction<'static, Sqlite>> {
        Ok(self.write.begin_with("BEGIN IMMEDIATE").await?)
    }

    /// Tests whether the disk can be written: commits a transaction that changes no data.
    pub(crate) async fn probe_write(&self) -> Result<()> {
        let mut transaction = self.begin().await?;
        // Faceoff does not use this number; setting it writes a page even if the value is unchanged.
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
