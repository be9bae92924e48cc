//! The table of banned remote workers (processes on other machines that run jobs), whose results are rejected.

use crate::{column::Instant, error::Result};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A ban of a remote worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerBan {
    /// Name of the worker.
    pub worker: String,
    /// When it was imposed.
    pub at: Timestamp,
    /// Shown to organisers.
    pub reason: String,
}

struct BanRow {
    worker: String,
    at: Instant,
    reason: String,
}

impl From<BanRow> for WorkerBan {
    fn from(row: BanRow) -> Self {
        Self {
            worker: row.worker,
            at: row.at.0,
            reason: row.reason,
        }
    }
}

/// Adds a ban; false if the worker is banned already.
pub(crate) async fn insert(connection: &mut SqliteConnection, ban: &WorkerBan) -> Result<bool> {
    let inserted = sqlx::query!(
        "INSERT INTO worker_bans (worker, banned_at, reason) VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
        ban.worker,
        Instant(ban.at),
        ban.reason,
    )
    .execute(connection)
    .await?;
    Ok(inserted.rows_affected() == 1)
}

/// Removes a ban; false if the worker is not banned.
pub(crate) async fn delete(connection: &mut SqliteConnection, worker: &str) -> Result<bool> {
    let deleted = sqlx::query!("DELETE FROM worker_bans WHERE worker = ?", worker)
        .execute(connection)
        .await?;
    Ok(deleted.rows_affected() == 1)
}

/// The reason of a worker's ban; `None` if it is not banned.
pub(crate) async fn reason(
    connection: &mut SqliteConnection,
    worker: &str,
) -> Result<Option<String>> {
    let reason = sqlx::query_scalar!("SELECT reason FROM worker_bans WHERE worker = ?", worker)
        .fetch_optional(connection)
        .await?;
    Ok(reason)
}

pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<WorkerBan>> {
    let rows = sqlx::query_as!(
        BanRow,
        "SELECT worker, banned_at AS at, reason FROM worker_bans ORDER BY worker",
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(WorkerBan::from).collect())
}
