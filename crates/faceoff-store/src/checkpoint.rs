//! Checkpoints: SQLite appends changes to a write-ahead log (the file `faceoff.sqlite3-wal`); a checkpoint copies
//! them into the database file.
//!
//! SQLite does so automatically every thousand pages, but restarts the log only when no reader uses it.
//! With overlapping readers there is no such moment, and the log would grow without bound. So beyond a
//! certain size this process blocks its new readers once, to empty the log.

use crate::{
    database::{BUSY_TIMEOUT, Database},
    error::Result,
    write_ahead_log::MAX_LOG_BYTES,
};
use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

/// How long new readers are blocked while this process's running reads end, and how long a checkpoint
/// waits for readers of other processes.
const READER_TIMEOUT: Duration = Duration::from_secs(2);

/// Clears `is_emptying` of the log on drop, so that the log can be emptied again however this attempt ends.
struct EmptyingGuard<'a>(&'a AtomicBool);

impl Drop for EmptyingGuard<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl Database {
    /// Called after a write: empties the log in the background if it exceeds its size limit.
    pub(crate) fn empty_log_if_large(&self) {
        if self.log.bytes() >= self.log.due_bytes.load(Ordering::Relaxed)
            && !self.log.is_emptying.load(Ordering::Acquire)
        {
            let database = self.clone();
            tokio::spawn(async move { database.empty_log().await });
        }
    }

    /// Called periodically: copies the changes that can be copied without blocking a reader or a writer. A log beyond its
    /// limit is emptied instead: the reader that prevented this earlier may have ended.
    pub(crate) async fn checkpoint(&self) -> Result<()> {
        if self.log.bytes() >= MAX_LOG_BYTES {
            self.empty_log().await;
            return Ok(());
        }
        let mut writer = self.write.acquire().await?;
        sqlx::query("PRAGMA wal_checkpoint(PASSIVE)")
            .execute(&mut *writer)
            .await?;
        Ok(())
    }

    /// Tries to empty the log, unless another attempt is running. The first failure in a row is logged, and the success after it.
    async fn empty_log(&self) {
        if self.log.is_emptying.swap(true, Ordering::AcqRel) {
            return;
        }
        let _guard = EmptyingGuard(&self.log.is_emptying);
        let bytes_before = self.log.bytes();
        let outcome = self.truncate_log().await;
        let last_attempt_failed = self.log.due_bytes.load(Ordering::Relaxed) > MAX_LOG_BYTES;
        match outcome {
            Ok(true) => {
                self.log.due_bytes.store(MAX_LOG_BYTES, Ordering::Relaxed);
                if last_attempt_failed {
                    tracing::info!(bytes = bytes_before, "the database's log is emptied");
                }
            }
            Ok(false) | Err(_) => {
                let due_bytes = bytes_before.saturating_add(MAX_LOG_BYTES / 4);
                self.log.due_bytes.store(due_bytes, Ordering::Relaxed);
                if !last_attempt_failed {
                    tracing::warn!(
                        bytes = bytes_before,
                        cause = outcome.err().map_or_else(
                            || "a read is still running, here or in another process".to_owned(),
                            |error| error.to_string()
                        ),
                        "the database's log cannot be emptied and grows; trying again"
                    );
                }
            }
        }
    }

    /// Copies the whole log into the database file and empties it. False if a reader blocks the checkpoint.
    async fn truncate_log(&self) -> Result<bool> {
        let mut writer = self.write.acquire().await?;
        // While this function holds all of this process's read connections, no reader of this process is active.
        let _readers = tokio::time::timeout(READER_TIMEOUT, self.read.all()).await;
        // Writers are blocked meanwhile, so the wait for another process's reader must be short.
        sqlx::query(sqlx::AssertSqlSafe(busy_timeout(READER_TIMEOUT)))
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
}

fn busy_timeout(timeout: Duration) -> String {
    format!("PRAGMA busy_timeout = {}", timeout.as_millis())
}
