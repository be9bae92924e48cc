//! What is kept of uploads: whose archives take how much room, and which are nobody's any more. They are
//! columns of the submissions.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    event::Actor,
    tables::submissions::REFUSED,
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
/// if it came at `before` or earlier. Nothing that a run names, no key of an upload that may play, and no evidence.
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
             AND NOT EXISTS (SELECT 1 FROM teams t
                             WHERE t.id = s.team_id AND (t.disqualified_at IS NOT NULL OR t.retired_by_organiser = 1))
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
        "UPDATE submissions SET bundle_removed_at = ?, bundle_gone = 1
         WHERE id = ? AND state IN ('invalid', 'validation_error') AND bundle_removed_at IS NULL",
        now,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The keys of all archives whose files have not gone.
pub(crate) async fn kept(connection: &mut SqliteConnection) -> Result<HashSet<String>> {
    let keys = sqlx::query_scalar!("SELECT bundle_key FROM submissions WHERE bundle_gone = 0")
        .fetch_all(connection)
        .await?;
    Ok(keys.into_iter().collect())
}

/// From now on nobody is promised the archive of a submission.
pub(crate) async fn remove(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE submissions SET bundle_removed_at = ?, bundle_removed_for = ? WHERE id = ?",
        now,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Somebody wished it away.
pub(crate) async fn set_deleted(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    by: &Actor,
    now: Timestamp,
) -> Result<()> {
    let (id, by, now) = (Text(id), Text(by), Instant(now));
    sqlx::query!(
        "UPDATE submissions SET deleted_at = ?, deleted_by = ? WHERE id = ?",
        now,
        by,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The archives whose files are there although nobody is promised them since `before`, with their keys; none that
/// another submission has, too, and none that has become evidence.
pub(crate) async fn going(
    connection: &mut SqliteConnection,
    before: Timestamp,
) -> Result<Vec<(SubmissionId, String)>> {
    let before = Instant(before);
    let rows = sqlx::query!(
        r#"SELECT s.id AS "id: Text<SubmissionId>", s.bundle_key FROM submissions s
           JOIN teams t ON t.id = s.team_id
           WHERE s.bundle_removed_at IS NOT NULL AND s.bundle_removed_at <= ? AND s.bundle_gone = 0
             AND t.disqualified_at IS NULL AND t.retired_by_organiser = 0
             AND NOT EXISTS (SELECT 1 FROM submissions o
                             WHERE o.team_id = s.team_id AND o.bundle_key = s.bundle_key
                               AND o.bundle_removed_at IS NULL)"#,
        before
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.id.0, row.bundle_key))
        .collect())
}

/// The file of a removed archive has gone.
pub(crate) async fn set_gone(connection: &mut SqliteConnection, id: SubmissionId) -> Result<()> {
    let id = Text(id);
    sqlx::query!("UPDATE submissions SET bundle_gone = 1 WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Refuses to have a submission play whose archive was removed.
pub(crate) async fn check_kept(connection: &mut SqliteConnection, id: SubmissionId) -> Result<()> {
    let text = Text(id);
    let removed = sqlx::query!(
        r#"SELECT bundle_removed_at AS "at!: Instant", bundle_removed_for AS reason FROM submissions
           WHERE id = ? AND bundle_removed_at IS NOT NULL"#,
        text
    )
    .fetch_optional(connection)
    .await?;
    match removed {
        None => Ok(()),
        Some(row) => Err(StoreError::Conflict(format!(
            "the archive of the submission {id} was removed on {} {}, so it cannot be played again",
            row.at.0.strftime("%Y-%m-%d at %H:%M:%S UTC"),
            row.reason.as_deref().unwrap_or(REFUSED),
        ))),
    }
}

/// What a submission's archive is needed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Needs {
    /// It enters the next cut.
    pub(crate) is_active: bool,
    /// Evaluations, and an ablation, that are not over.
    pub(crate) open: u32,
    /// Its evaluations of days that are not released.
    pub(crate) unreleased: u32,
    /// Trials and proposals with it that are neither applied nor dropped.
    pub(crate) proposed: u32,
}

pub(crate) async fn needs(connection: &mut SqliteConnection, id: SubmissionId) -> Result<Needs> {
    let id = Text(id);
    Ok(sqlx::query_as!(
        Needs,
        r#"SELECT EXISTS (SELECT 1 FROM active_submissions WHERE submission_id = ?1) AS "is_active!: bool",
                  (SELECT COUNT(*) FROM evaluations WHERE submission_id = ?1 AND state = 'open')
                  + (SELECT COUNT(*) FROM ablations WHERE submission_id = ?1 AND finished_at IS NULL)
                  AS "open!: u32",
                  (SELECT COUNT(*) FROM evaluations e JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
                   WHERE e.submission_id = ?1 AND d.released_at IS NULL) AS "unreleased!: u32",
                  (SELECT COUNT(DISTINCT p.id) FROM drafts d JOIN proposals p ON p.id = d.proposal_id
                   WHERE d.submission_id = ?1 AND p.outcome IS NULL) AS "proposed!: u32""#,
        id
    )
    .fetch_one(connection)
    .await?)
}
