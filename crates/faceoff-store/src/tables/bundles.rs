//! Bundles (uploaded agents): quotas of the teams, and bundles that can be deleted. The data are columns of the table of
//! submissions. *Evidence* are the bundles of a team that is disqualified, or that an organiser has retired: they are kept.
//!
//! Terms of the queries: the table `contestants` has the submission that plays each *run* (all episodes of an evaluation, or of one
//! profile of an ablation). The view `counting_evaluations` has the evaluations of days, also voided ones, which do not count. A row
//! of `proposals` is a trial or a re-evaluation that an organiser requested. The evaluations of a re-evaluation count only if the
//! organiser applies it, those of a trial never.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    event::Actor,
    tables::submissions::REMOVED_AS_INVALID,
};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::SqliteConnection;
use std::collections::HashSet;

/// Upload and storage quota of a team, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UploadQuota {
    /// Limit of uploads per UTC day.
    pub day_bytes: u64,
    /// Limit of bundles stored at the same time.
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

/// A team's use of its quota, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UploadUsage {
    /// Uploaded on the UTC day. Invalid bundles count; those whose validation ended by a platform fault do not.
    pub day_bytes: u64,
    /// Bundles that are stored.
    pub stored_bytes: u64,
}

impl UploadQuota {
    /// Checks whether a team with this usage may upload another bundle.
    ///
    /// # Errors
    /// [`StoreError::DailyQuotaExceeded`] or [`StoreError::StorageQuotaExceeded`].
    pub fn check(&self, used: UploadUsage, bundle_bytes: u64) -> Result<()> {
        let exceeds =
            |used: u64, limit: u64| used.checked_add(bundle_bytes).is_none_or(|sum| sum > limit);
        if exceeds(used.day_bytes, self.day_bytes) {
            return Err(StoreError::DailyQuotaExceeded {
                limit_bytes: self.day_bytes,
                used_bytes: used.day_bytes,
                bundle_bytes,
            });
        }
        if exceeds(used.stored_bytes, self.stored_bytes) {
            return Err(StoreError::StorageQuotaExceeded {
                limit_bytes: self.stored_bytes,
                used_bytes: used.stored_bytes,
                bundle_bytes,
            });
        }
        Ok(())
    }

    /// Maximum size of the team's next bundle, in bytes.
    #[must_use]
    pub fn remaining(&self, used: UploadUsage) -> u64 {
        let remaining_today = self.day_bytes.saturating_sub(used.day_bytes);
        remaining_today.min(self.stored_bytes.saturating_sub(used.stored_bytes))
    }
}

/// A team's use of its quota on the UTC day that began at `day_start`.
pub(crate) async fn usage(
    connection: &mut SqliteConnection,
    team: TeamId,
    day_start: Timestamp,
) -> Result<UploadUsage> {
    let row = sqlx::query!(
        r#"SELECT COALESCE(SUM(CASE WHEN created_at >= ? AND state <> 'validation_error'
                                    THEN bundle_bytes ELSE 0 END), 0) AS "day_bytes!: i64",
                  COALESCE(SUM(CASE WHEN bundle_removed_at IS NULL
                                    THEN bundle_bytes ELSE 0 END), 0) AS "stored_bytes!: i64"
           FROM submissions WHERE team_id = ?"#,
        Instant(day_start),
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

/// Submissions that did not pass their validation and whose bundles are stored, with their keys. These are invalid ones,
/// and those uploaded until `uploaded_until` whose validation ended by a platform fault. Bundles that are used by a run or
/// another submission, and evidence, are left out.
pub(crate) async fn with_failed_validation(
    connection: &mut SqliteConnection,
    uploaded_until: Timestamp,
) -> Result<Vec<(SubmissionId, String)>> {
    let rows = sqlx::query!(
        "SELECT s.id, s.bundle_key FROM submissions s
         WHERE s.bundle_removed_at IS NULL AND s.state IN ('invalid', 'validation_error')
           AND (s.state = 'invalid' OR s.created_at <= ?)
           AND NOT EXISTS (SELECT 1 FROM contestants c WHERE c.submission_id = s.id)
           AND NOT EXISTS (SELECT 1 FROM teams t
                           WHERE t.id = s.team_id AND (t.disqualified_at IS NOT NULL OR t.retired_by_organiser = 1))
           AND NOT EXISTS (SELECT 1 FROM submissions o
                           WHERE o.team_id = s.team_id AND o.bundle_key = s.bundle_key
                             AND o.state IN ('validating', 'valid'))",
        Instant(uploaded_until),
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.id, row.bundle_key))
        .collect())
}

/// Marks the bundle of a submission that did not pass its validation as removed, with its file.
pub(crate) async fn set_failed_removed(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET bundle_removed_at = ?, bundle_gone = 1
         WHERE id = ? AND state IN ('invalid', 'validation_error') AND bundle_removed_at IS NULL",
        Instant(now),
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The keys of all bundles whose files exist.
pub(crate) async fn keys_in_use(connection: &mut SqliteConnection) -> Result<HashSet<String>> {
    let keys = sqlx::query_scalar!("SELECT bundle_key FROM submissions WHERE bundle_gone = 0")
        .fetch_all(connection)
        .await?;
    Ok(keys.into_iter().collect())
}

/// Marks a submission's bundle as removed; its file is deleted later.
pub(crate) async fn set_removed(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET bundle_removed_at = ?, bundle_removed_for = ? WHERE id = ?",
        Instant(now),
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Records the actor that requested the removal of a submission's bundle.
pub(crate) async fn set_deleted(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    actor: &Actor,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET deleted_at = ?, deleted_by = ? WHERE id = ?",
        Instant(now),
        actor,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Bundles that were marked as removed until `removed_until` and whose files still exist, with their keys. Bundles that
/// another submission shares, and those that are evidence, are left out.
pub(crate) async fn deletable(
    connection: &mut SqliteConnection,
    removed_until: Timestamp,
) -> Result<Vec<(SubmissionId, String)>> {
    let rows = sqlx::query!(
        "SELECT s.id, s.bundle_key FROM submissions s
         JOIN teams t ON t.id = s.team_id
         WHERE s.bundle_removed_at IS NOT NULL AND s.bundle_removed_at <= ? AND s.bundle_gone = 0
           AND t.disqualified_at IS NULL AND t.retired_by_organiser = 0
           AND NOT EXISTS (SELECT 1 FROM submissions o
                           WHERE o.team_id = s.team_id AND o.bundle_key = s.bundle_key
                             AND o.bundle_removed_at IS NULL)",
        Instant(removed_until)
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.id, row.bundle_key))
        .collect())
}

/// Records that the file of a removed bundle was deleted.
pub(crate) async fn set_file_deleted(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<()> {
    sqlx::query!("UPDATE submissions SET bundle_gone = 1 WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Refuses a submission whose bundle was removed.
pub(crate) async fn check_available(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<()> {
    let removed = sqlx::query!(
        r#"SELECT bundle_removed_at AS "at!", bundle_removed_for AS reason FROM submissions
           WHERE id = ? AND bundle_removed_at IS NOT NULL"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    match removed {
        None => Ok(()),
        Some(row) => StoreError::conflict(format!(
            "the bundle of the submission {id} was removed on {} {}, so it cannot be evaluated again",
            row.at.0.strftime("%Y-%m-%d at %H:%M:%S UTC"),
            row.reason.as_deref().unwrap_or(REMOVED_AS_INVALID),
        )),
    }
}

/// Why a submission's bundle is still needed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BundleUses {
    /// Is it the team's active submission?
    pub(crate) is_active: bool,
    /// Number of its open evaluations and ablations.
    pub(crate) open: u32,
    /// Number of its evaluations on unreleased days, also failed and voided ones.
    pub(crate) unreleased: u32,
    /// Number of undecided proposals (trials and requested re-evaluations, neither applied nor dropped) in which it is evaluated.
    pub(crate) proposed: u32,
}

pub(crate) async fn uses(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<BundleUses> {
    Ok(sqlx::query_as!(
        BundleUses,
        r#"SELECT EXISTS (SELECT 1 FROM active_submissions WHERE submission_id = ?1) AS "is_active!: bool",
                  (SELECT COUNT(*) FROM counting_evaluations WHERE submission_id = ?1 AND state = 'open')
                  + (SELECT COUNT(*) FROM ablations WHERE submission_id = ?1 AND finished_at IS NULL)
                  AS "open!: u32",
                  (SELECT COUNT(*) FROM counting_evaluations e JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
                   WHERE e.submission_id = ?1 AND d.released_at IS NULL) AS "unreleased!: u32",
                  (SELECT COUNT(DISTINCT p.id) FROM evaluations d JOIN proposals p ON p.id = d.proposal_id
                   WHERE d.submission_id = ?1 AND p.outcome IS NULL) AS "proposed!: u32""#,
        id
    )
    .fetch_one(connection)
    .await?)
}
