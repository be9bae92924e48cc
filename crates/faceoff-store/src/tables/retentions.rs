//! The table of retentions, which say how long a stage's large files (datasets and bundles) are kept, and queries for their
//! removal.
//!
//! The view `counting_evaluations` has the evaluations of days, also open, failed and voided ones, but not those of proposals
//! (trials, and re-evaluations that were not applied).

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
};
use faceoff_types::{EvaluationId, Retention, StageId, SubmissionId, TeamId, Tier};
use jiff::Timestamp;
use serde::Deserialize;
use sqlx::SqliteConnection;
use std::cmp::Ordering;

/// The retention of a stage; everything is kept if none is set.
pub(crate) async fn of_stage(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Retention> {
    let retention = sqlx::query_scalar!(
        "SELECT retention FROM stage_retentions WHERE stage_id = ?",
        stage
    )
    .fetch_optional(connection)
    .await?;
    Ok(retention.map_or_else(Retention::default, |retention| retention.0))
}

/// The stages whose retention removes files at some time.
pub(crate) async fn stages_with_removals(
    connection: &mut SqliteConnection,
) -> Result<Vec<StageId>> {
    let stages = sqlx::query_scalar!(
        "SELECT stage_id AS stage FROM stage_retentions WHERE retention <> '{}'"
    )
    .fetch_all(connection)
    .await?;
    Ok(stages)
}

pub(crate) async fn set(
    connection: &mut SqliteConnection,
    stage: StageId,
    retention: &Retention,
) -> Result<()> {
    sqlx::query!(
        "INSERT OR REPLACE INTO stage_retentions (stage_id, retention) VALUES (?, ?)",
        stage,
        Json(retention)
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The part of a result that decides its rank on a board.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Rank {
    /// `None` in a competition without tiers.
    #[serde(default)]
    tier: Option<Tier>,
    score: f64,
    penalty_points: f64,
}

/// A finished evaluation, with the data that retention depends on.
#[derive(Debug, Clone)]
pub(crate) struct ScoredEvaluation {
    pub(crate) id: EvaluationId,
    pub(crate) team: TeamId,
    /// Revision of the stage's rules; a board shows one revision only.
    pub(crate) revision: u32,
    /// False if it was voided.
    pub(crate) counts: bool,
    /// Is its dataset stored?
    pub(crate) has_dataset: bool,
    /// Are all files of its team kept as evidence for the organisers?
    pub(crate) is_evidence: bool,
    /// Size of the dataset; `None` if it has not been measured.
    pub(crate) bytes: Option<u64>,
    submitted_at: Timestamp,
    rank: Rank,
}

impl ScoredEvaluation {
    /// Compares ranks as boards do, the better one first: by tier, score, penalty points, and time of the upload.
    pub(crate) fn compare_rank(&self, other: &Self) -> Ordering {
        let (a, b) = (&self.rank, &other.rank);
        a.tier
            .cmp(&b.tier)
            .then_with(|| b.score.total_cmp(&a.score))
            .then_with(|| a.penalty_points.total_cmp(&b.penalty_points))
            .then_with(|| self.submitted_at.cmp(&other.submitted_at))
    }
}

/// The finished evaluations of a stage, also voided ones, grouped by team, the newest day first.
pub(crate) async fn scored_evaluations(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Vec<ScoredEvaluation>> {
    let rows = sqlx::query!(
        r#"SELECT e.id, e.team_id AS team, e.revision, e.voided_at IS NULL AS "counts!: bool",
                  e.dataset_removed_at IS NULL AS "is_kept!: bool",
                  t.disqualified_at IS NOT NULL OR t.retired_by_organiser = 1 AS "is_evidence!: bool",
                  e.dataset_bytes AS bytes, s.created_at AS submitted_at, e.result AS "rank!: Json<Rank>"
           FROM counting_evaluations e JOIN teams t ON t.id = e.team_id JOIN submissions s ON s.id = e.submission_id
           WHERE e.stage_id = ? AND e.state = 'finished'
           ORDER BY e.team_id, e.day DESC, e.created_at DESC, e.id DESC"#,
        stage
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| ScoredEvaluation {
            id: row.id,
            team: row.team,
            revision: row.revision,
            counts: row.counts,
            has_dataset: row.is_kept,
            is_evidence: row.is_evidence,
            bytes: row.bytes,
            submitted_at: row.submitted_at.0,
            rank: row.rank.0,
        })
        .collect())
}

/// Number of a stage's proposals (trials and proposed re-evaluations) that are neither applied nor dropped.
pub(crate) async fn count_proposals(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM proposals WHERE stage_id = ? AND outcome IS NULL"#,
        stage
    )
    .fetch_one(connection)
    .await?)
}

/// Stored bundles, with their sizes, of submissions that were evaluated in a stage and are not needed any more. None is
/// active or has open jobs, and all their datasets are removed or in `removable`. None can be evaluated again, because
/// their stages are signed off, or the season is closed.
pub(crate) async fn idle_bundles(
    connection: &mut SqliteConnection,
    stage: StageId,
    removable: &[EvaluationId],
) -> Result<Vec<(SubmissionId, u64)>> {
    // `counting_evaluations` has voided evaluations, too: until their datasets are removed, the bundle is kept. Those of
    // proposals have a condition of their own.
    let rows = sqlx::query!(
        "SELECT s.id, s.bundle_bytes AS bytes
         FROM submissions s JOIN teams t ON t.id = s.team_id
         WHERE s.state = 'valid' AND s.bundle_removed_at IS NULL
           AND t.disqualified_at IS NULL AND t.retired_by_organiser = 0
           AND s.id IN (SELECT e.submission_id FROM counting_evaluations e WHERE e.stage_id = ?1 AND e.state = 'finished')
           AND NOT EXISTS (SELECT 1 FROM active_submissions a WHERE a.submission_id = s.id)
           AND NOT EXISTS (SELECT 1 FROM counting_evaluations e JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day
                           WHERE e.submission_id = s.id
                             AND (e.state = 'open' OR d.released_at IS NULL
                                  OR e.state = 'finished' AND e.dataset_removed_at IS NULL
                                     AND e.id NOT IN (SELECT value FROM json_each(?2))))
           AND ((SELECT closed_at FROM season) IS NOT NULL
                OR NOT EXISTS (SELECT 1 FROM counting_evaluations e JOIN stages st ON st.id = e.stage_id
                               WHERE e.submission_id = s.id AND st.finalised_at IS NULL))
           AND NOT EXISTS (SELECT 1 FROM evaluations d JOIN proposals p ON p.id = d.proposal_id
                           WHERE d.submission_id = s.id AND p.outcome IS NULL)
           AND NOT EXISTS (SELECT 1 FROM ablations a WHERE a.submission_id = s.id AND a.finished_at IS NULL)
           AND NOT EXISTS (SELECT 1 FROM round_submissions r JOIN tournaments o ON o.id = r.tournament_id
                           WHERE r.submission_id = s.id AND o.closed_at IS NULL)
           AND NOT EXISTS (SELECT 1 FROM tournaments o WHERE o.baseline_id = s.id AND o.closed_at IS NULL)
           AND NOT EXISTS (SELECT 1 FROM games g WHERE g.home_submission_id = s.id AND g.state IN ('queued', 'running'))
           AND NOT EXISTS (SELECT 1 FROM games g WHERE g.away_submission_id = s.id AND g.state IN ('queued', 'running'))",
        stage,
        Json(removable),
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id, row.bytes)).collect())
}

/// Marks an evaluation's dataset as removed. The file is deleted later.
pub(crate) async fn set_dataset_removed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET dataset_removed_at = ?, dataset_removed_for = ? WHERE id = ?",
        Instant(now),
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Datasets that were marked as removed until `removed_until` and whose files still exist, with their keys: of evaluations
/// of days, also voided ones. Evidence is left out.
pub(crate) async fn deletable_datasets(
    connection: &mut SqliteConnection,
    removed_until: Timestamp,
) -> Result<Vec<(EvaluationId, String)>> {
    let rows = sqlx::query!(
        r#"SELECT e.id, e.dataset AS "dataset!" FROM counting_evaluations e
           JOIN teams t ON t.id = e.team_id
           WHERE e.dataset_removed_at IS NOT NULL AND e.dataset_removed_at <= ? AND e.dataset_gone = 0
             AND t.disqualified_at IS NULL AND t.retired_by_organiser = 0"#,
        Instant(removed_until)
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id, row.dataset)).collect())
}

/// Evaluations of proposals that were dropped until `dropped_until` and whose datasets are still stored, with the keys of
/// these datasets.
pub(crate) async fn dropped_with_datasets(
    connection: &mut SqliteConnection,
    dropped_until: Timestamp,
) -> Result<Vec<(EvaluationId, String)>> {
    let rows = sqlx::query!(
        r#"SELECT e.id, e.dataset AS "dataset!"
           FROM proposals p CROSS JOIN evaluations e ON e.proposal_id = p.id
           WHERE p.outcome = 'dropped' AND p.settled_at <= ? AND e.dataset IS NOT NULL AND e.dataset_removed_at IS NULL"#,
        Instant(dropped_until)
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id, row.dataset)).collect())
}

/// Records that the dataset of a dropped proposal's evaluation was removed with its file.
pub(crate) async fn set_dropped_dataset_deleted(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations
         SET dataset_removed_at = ?, dataset_removed_for = 'the proposal was dropped', dataset_gone = 1 WHERE id = ?",
        Instant(now),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Records that the file of a removed dataset was deleted.
pub(crate) async fn set_dataset_file_deleted(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<()> {
    sqlx::query!("UPDATE evaluations SET dataset_gone = 1 WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Datasets whose size is unknown, with their keys.
pub(crate) async fn unmeasured(
    connection: &mut SqliteConnection,
) -> Result<Vec<(EvaluationId, String)>> {
    let rows = sqlx::query!(
        r#"SELECT id, dataset AS "dataset!" FROM evaluations
           WHERE state = 'finished' AND dataset_bytes IS NULL AND dataset_removed_at IS NULL"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id, row.dataset)).collect())
}

/// Stores the size of an evaluation's dataset.
pub(crate) async fn set_dataset_bytes(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    bytes: u64,
) -> Result<()> {
    let bytes = i64::try_from(bytes)
        .map_err(|_| StoreError::Damaged(format!("a dataset of {bytes} bytes")))?;
    sqlx::query!(
        "UPDATE evaluations SET dataset_bytes = ? WHERE id = ? AND state = 'finished'",
        bytes,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
