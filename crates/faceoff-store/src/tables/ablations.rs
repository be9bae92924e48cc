//! The tables of ablations and their runs. An ablation shows which perturbation costs a submission points.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    tables::run_progress::RunProgress,
};
use faceoff_types::{AblationId, ProfileMap, RunId, SubmissionId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// An ablation: runs of a submission on the same episodes without any perturbation, with each one alone, and with all.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablation {
    pub id: AblationId,
    pub submission: SubmissionId,
    /// One run for each profile; the rest of their plans is the same. The order has no meaning.
    pub runs: ProfileMap<RunId>,
    /// Episodes of each task and profile.
    pub episodes_per_task: u32,
    /// When it was requested.
    pub created_at: Timestamp,
    pub state: AblationState,
}

#[derive(Debug, Clone, PartialEq)]
pub enum AblationState {
    /// Queued or running.
    Unfinished {
        /// Of all profiles.
        progress: RunProgress,
        /// Episodes over all profiles and tasks.
        episodes_total: u32,
    },
    /// The runs of all profiles are complete.
    Finished {
        /// When the last shard was committed.
        finished_at: Timestamp,
    },
    /// The ablation ended without a result.
    Failed {
        /// When it was given up.
        finished_at: Timestamp,
        /// The fault, and whether it is the agent's or the platform's.
        reason: String,
    },
}

/// An ablation without its runs.
pub(crate) struct AblationRow {
    pub(crate) id: AblationId,
    pub(crate) submission_id: SubmissionId,
    pub(crate) created_at: Instant,
    pub(crate) finished_at: Option<Instant>,
    pub(crate) reason: Option<String>,
}

/// The newest ablation of a submission.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<Option<AblationRow>> {
    Ok(sqlx::query_as!(
        AblationRow,
        "SELECT id, submission_id, created_at, finished_at, reason
         FROM ablations WHERE submission_id = ? ORDER BY created_at DESC, id DESC LIMIT 1",
        submission
    )
    .fetch_optional(connection)
    .await?)
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: AblationId) -> Result<AblationRow> {
    sqlx::query_as!(
        AblationRow,
        "SELECT id, submission_id, created_at, finished_at, reason
         FROM ablations WHERE id = ?",
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("ablation"))
}

/// The ablation that owns a run, if one does.
pub(crate) async fn of_run(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Option<AblationId>> {
    let found = sqlx::query_scalar!(
        "SELECT ablation_id AS id FROM ablation_runs WHERE run_id = ?",
        run
    )
    .fetch_optional(connection)
    .await?;
    Ok(found)
}

pub(crate) async fn runs(connection: &mut SqliteConnection, id: AblationId) -> Result<Vec<RunId>> {
    let runs = sqlx::query_scalar!(
        "SELECT run_id AS id FROM ablation_runs WHERE ablation_id = ?",
        id
    )
    .fetch_all(connection)
    .await?;
    Ok(runs)
}

/// Adds an ablation. [`StoreError::Conflict`] while another ablation of the submission is open.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    id: AblationId,
    submission: SubmissionId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO ablations (id, submission_id, created_at) VALUES (?, ?, ?)",
        id,
        submission,
        Instant(now),
    )
    .execute(connection)
    .await
    .map_err(StoreError::if_duplicate("ablations.submission_id", || {
        StoreError::Conflict("an ablation of this submission is running: wait for its end".into())
    }))?;
    Ok(())
}

pub(crate) async fn insert_run(
    connection: &mut SqliteConnection,
    id: AblationId,
    run: RunId,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO ablation_runs (ablation_id, run_id) VALUES (?, ?)",
        id,
        run
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends an ablation, without a result if there is a `reason`.
pub(crate) async fn set_ended(
    connection: &mut SqliteConnection,
    id: AblationId,
    reason: Option<&str>,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE ablations SET finished_at = ?, reason = ? WHERE id = ? AND finished_at IS NULL",
        Instant(now),
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Is every run of the ablation complete?
pub(crate) async fn all_complete(
    connection: &mut SqliteConnection,
    id: AblationId,
) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT NOT EXISTS (SELECT 1 FROM ablation_runs a JOIN runs r ON r.id = a.run_id
                              WHERE a.ablation_id = ? AND r.state <> 'played') AS "played!: bool""#,
        id,
    )
    .fetch_one(connection)
    .await?)
}
