//! What the database has beside it: changes are appended to a log (`-wal`) and copied into the database
//! by checkpoints.
//!
//! SQLite copies by itself every thousand pages, but starts the log anew only when no reader uses it; with
//! readers that overlap there is no such moment, and the log would grow as long as they come. So beyond
//! a bound the readers of this process are kept waiting for once.

use crate::{
    database::{BUSY_TIMEOUT, Database, READERS},
    error::Result,
    log::LOG_BOUND_BYTES,
};
use sqlx::{Sqlite, pool::PoolConnection};
use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

/// How long new readers are kept waiting for those of this process that are under way, and a
/// checkpoint for those of others.
const READERS_PATIENCE: Duration = Duration::from_secs(2);

/// Lets the next one empty the log, however this one ends.
struct Emptying<'a>(&'a AtomicBool);

impl Drop for Emptying<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl Database {
    /// After a write: empties the log, beside what comes next, if it has grown beyond its bound.
    pub(crate) fn log_has_grown(&self) {
        if self.log.bytes() >= self.log.due_bytes.load(Ordering::Relaxed)
            && !self.log.emptying.load(Ordering::Acquire)
        {
            let database = self.clone();
            tokio::spawn(async move { database.empty_log().await });
        }
    }

    /// Now and then: copies what can be copied without keeping anybody waiting, and empties a log
    /// that has stayed beyond its bound because of somebody who is gone now.
    pub(crate) async fn checkpoint(&self) -> Result<()> {
        if self.log.bytes() >= LOG_BOUND_BYTES {
            self.empty_log().await;
            return Ok(());
        }
        let mut writer = self.write.acquire().await?;
        sqlx::query("PRAGMA wal_checkpoint(PASSIVE)")
            .execute(&mut *writer)
            .await?;
        Ok(())
    }

    async fn empty_log(&self) {
        if self.log.emptying.swap(true, Ordering::AcqRel) {
            return;
        }
        let _emptying = Emptying(&self.log.emptying);
        let before = self.log.bytes();
        let emptied = self.truncate_log().await;
        let failed_before = self.log.due_bytes.load(Ordering::Relaxed) > LOG_BOUND_BYTES;
        match emptied {
            Ok(true) => {
                self.log.due_bytes.store(LOG_BOUND_BYTES, Ordering::Relaxed);
                if failed_before {
                    tracing::info!(bytes = before, "the database's log is emptied");
                }
            }
            Ok(false) | Err(_) => {
                let due_bytes = before.saturating_add(LOG_BOUND_BYTES / 4);
                self.log.due_bytes.store(due_bytes, Ordering::Relaxed);
                if !failed_before {
                    tracing::warn!(
                        bytes = before,
                        cause = emptied.err().map_or_else(
                            || "somebody else reads the database".to_owned(),
                            |error| error.to_string()
                        ),
                        "the database's log cannot be emptied and grows; trying again"
                    );
                }
            }
        }
    }

    /// False: a reader of another process is in the way.
    async fn truncate_log(&self) -> Result<bool> {
        let mut writer = self.write.acquire().await?;
        // With all of this process's readers in hand there is nobody to wait for.
        let _readers = tokio::time::timeout(READERS_PATIENCE, self.all_readers()).await;
        // Writers wait meanwhile, so that another process's reader must not be waited for long.
        sqlx::query(sqlx::AssertSqlSafe(busy_timeout(READERS_PATIENCE)))
            .execute(&mut *writer)
            .await?;
        let busy: Result<i64, _> = sqlx::query_scalar("PRAGMA wal_checkpoint(TRUNCATE)")
            .fetch_one(&mut *writer)
            .await;
        sqlx::query(sqlx::AssertSqlSafe(busy_timeout(BUSY_TIMEOUT)))
            .execute(&mut *writer)
            .await?;
        Ok(busy? == 0)
    }

    async fn all_readers(&self) -> Result<Vec<PoolConnection<Sqlite>>> {
        let mut readers = Vec::with_capacity(READERS as usize);
        for _ in 0..READERS {
            readers.push(self.read.acquire().await?);
        }
        Ok(readers)
    }
}

fn busy_timeout(patience: Duration) -> String {
    format!("PRAGMA busy_timeout = {}", patience.as_millis())
}
