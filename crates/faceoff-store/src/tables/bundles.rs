//! What is kept of uploads: whose archives take how much room, and which are nobody's any more. They are
//! columns of the submissions.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use std::collections::HashSet;

/// How much a team may upload and keep, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UploadQuota {
    /// Of a UTC day.
    pub day_bytes: u64,
    /// Kept at the same time.
    pub stored_bytes: u64,
}

impl Default for UploadQuota {
    fn default() -> Self {
        Self {
            day_bytes: 4 << 30,
            stored_bytes: 32 << 30,
        }
    }
}

/// What a team has used of its quota, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UploadUsage {
    /// Uploaded on the UTC day, what was refused included; not what we failed to check.
    pub day_bytes: u64,
    /// The archives that are kept.
    pub stored_bytes: u64,
}

impl UploadQuota {
    /// May a team that has used so much upload this many bytes more?
    ///
    /// # Errors
    /// [`StoreError::DayQuotaSpent`] or [`StoreError::StoredQuotaSpent`].
    pub fn check(&self, used: UploadUsage, bundle_bytes: u64) -> Result<()> {
        let spent =
            |used: u64, limit: u64| used.checked_add(bundle_bytes).is_none_or(|sum| sum > limit);
        if spent(used.day_bytes, self.day_bytes) {
            return Err(StoreError::DayQuotaSpent {
                limit_bytes: self.day_bytes,
                used_bytes: used.day_bytes,
                bundle_bytes,
            });
        }
        if spent(used.stored_bytes, self.stored_bytes) {
            return Err(StoreError::StoredQuotaSpent {
                limit_bytes: self.stored_bytes,
                used_bytes: used.stored_bytes,
                bundle_bytes,
            });
        }
        Ok(())
    }

    /// How large the team's next bundle may be.
    #[must_use]
    pub fn left(&self, used: UploadUsage) -> u64 {
        let of_day = self.day_bytes.saturating_sub(used.day_bytes);
        of_day.min(self.stored_bytes.saturating_sub(used.stored_bytes))
    }
}

/// What a team has used, of the day that began at `day`.
pub(crate) async fn usage(
    connection: &mut SqliteConnection,
    team: TeamId,
    day: Timestamp,
) -> Result<UploadUsage> {
    let (team, day) = (Text(team), Instant(day));
    let row = sqlx::query!(
        r#"SELECT COALESCE(SUM(CASE WHEN created_at >= ? AND state <> 'validation_error'
                                    THEN bundle_bytes ELSE 0 END), 0) AS "day_bytes!: i64",
                  COALESCE(SUM(CASE WHEN bundle_removed_at IS NULL
                                    THEN bundle_bytes ELSE 0 END), 0) AS "stored_bytes!: i64"
           FROM submissions WHERE team_id = ?"#,
        day,
        team,
    )
    .fetch_one(connection)
    .await?;
    let bytes = |sum: i64| {
        u64::try_from(sum).map_err(|_| StoreError::Damaged(format!("bundles of {sum} bytes")))
    };
    Ok(UploadUsage {
        day_bytes: bytes(row.day_bytes)?,
        stored_bytes: bytes(row.stored_bytes)?,
    })
}

/// Refused uploads whose archives are kept, with their keys: what is invalid, and what we failed to check
/// if it came at `before` or earlier. Nothing that a run names, and no key of an upload that may play.
pub(crate) async fn refused(
    connection: &mut SqliteConnection,
    before: Timestamp,
) -> Result<Vec<(SubmissionId, String)>> {
    let before = Instant(before);
    let rows = sqlx::query!(
        r#"SELECT s.id AS "id: Text<SubmissionId>", s.bundle_key FROM submissions s
           WHERE s.bundle_removed_at IS NULL AND s.state IN ('invalid', 'validation_error')
             AND (s.state = 'invalid' OR s.created_at <= ?)
             AND NOT EXISTS (SELECT 1 FROM contestants c WHERE c.submission_id = s.id)
             AND NOT EXISTS (SELECT 1 FROM submissions o
                             WHERE o.team_id = s.team_id AND o.bundle_key = s.bundle_key
                               AND o.state IN ('validating', 'valid'))"#,
        before,
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.id.0, row.bundle_key))
        .collect())
}

pub(crate) async fn set_removed(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE submissions SET bundle_removed_at = ?
         WHERE id = ? AND state IN ('invalid', 'validation_error')",
        now,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The keys of all archives that are kept.
pub(crate) async fn kept(connection: &mut SqliteConnection) -> Result<HashSet<String>> {
    let keys =
        sqlx::query_scalar!("SELECT bundle_key FROM submissions WHERE bundle_removed_at IS NULL")
            .fetch_all(connection)
            .await?;
    Ok(keys.into_iter().collect())
}
