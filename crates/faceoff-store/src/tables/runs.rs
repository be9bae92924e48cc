//! The table of runs. A run plays episodes for an evaluation or an ablation, and is divided into shards.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::run_plan::RunPlan,
};
use faceoff_types::{Ruleset, RunId, SeedLabel, SubmissionId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A run: episodes of one or more submissions under one plan, divided into shards.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Part of the artifact keys of its recordings.
    pub id: RunId,
    pub ruleset: Ruleset,
    pub plan: RunPlan,
    pub seed: SeedLabel,
    /// Are its shards recorded? If not, only their outcomes are stored.
    pub keeps_recordings: bool,
}

/// State of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx::Type)]
#[sqlx(rename_all = "snake_case")]
pub(crate) enum RunState {
    /// No shard was claimed.
    Queued,
    Running,
    /// Every shard is committed.
    #[sqlx(rename = "played")]
    Complete,
    /// Its owner ended before the run was complete.
    Stopped,
}

/// Adds a queued run with its contestants (the submissions that play it), from side 0 on.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    run: &Run,
    contestants: &[SubmissionId],
) -> Result<()> {
    let (id, plan) = (run.id, &run.plan);
    let limits = (!plan.limits.is_empty()).then_some(Json(&plan.limits));
    let variation = (!plan.variation.is_empty()).then_some(Json(&plan.variation));
    sqlx::query!(
        "INSERT INTO runs (id, profile, seed, tasks, episodes_per_task, episodes_per_shard, max_faults,
                           keeps_recordings, ruleset, variation, limits, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'queued')",
        id,
        plan.profile,
        run.seed,
        Json(&plan.tasks),
        plan.episodes_per_task,
        plan.episodes_per_shard,
        plan.max_faults,
        run.keeps_recordings,
        run.ruleset,
        variation,
        limits,
    )
    .execute(&mut *connection)
    .await?;
    for (side, submission) in (0_u32..).zip(contestants) {
        let submission = *submission;
        sqlx::query!(
            "INSERT INTO contestants (run_id, side, submission_id) VALUES (?, ?, ?)",
            id,
            side,
            submission,
        )
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: RunId) -> Result<Run> {
    let row = sqlx::query!(
        "SELECT profile, seed, tasks, episodes_per_task, episodes_per_shard, max_faults, keeps_recordings, ruleset,
                variation, limits
         FROM runs WHERE id = ?",
        id,
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("run"))?;
    Ok(Run {
        id,
        ruleset: row.ruleset,
        plan: RunPlan {
            profile: row.profile,
            tasks: row.tasks.0,
            episodes_per_task: row.episodes_per_task,
            episodes_per_shard: row.episodes_per_shard,
            max_faults: row.max_faults,
            variation: row
                .variation
                .map(|variation| variation.0)
                .unwrap_or_default(),
            limits: row.limits.map(|limits| limits.0).unwrap_or_default(),
        },
        seed: row.seed,
        keeps_recordings: row.keeps_recordings,
    })
}

/// The submissions of a run, from side 0 on.
pub(crate) async fn contestants(
    connection: &mut SqliteConnection,
    id: RunId,
) -> Result<Vec<SubmissionId>> {
    let rows = sqlx::query_scalar!(
        "SELECT submission_id AS id FROM contestants
         WHERE run_id = ? ORDER BY side",
        id,
    )
    .fetch_all(connection)
    .await?;
    Ok(rows)
}

/// Marks a run as running. True if the claimed shard is its first.
pub(crate) async fn begin(connection: &mut SqliteConnection, id: RunId) -> Result<bool> {
    let begun = sqlx::query!(
        "UPDATE runs SET state = 'running' WHERE id = ? AND state = 'queued'",
        id
    )
    .execute(connection)
    .await?;
    Ok(begun.rows_affected() == 1)
}

/// Marks a run as complete.
pub(crate) async fn set_complete(connection: &mut SqliteConnection, id: RunId) -> Result<()> {
    sqlx::query!("UPDATE runs SET state = 'played' WHERE id = ?", id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Stops a run that is not complete.
pub(crate) async fn set_stopped(connection: &mut SqliteConnection, id: RunId) -> Result<()> {
    sqlx::query!(
        "UPDATE runs SET state = 'stopped' WHERE id = ? AND state IN ('queued', 'running')",
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The runs whose recordings are stored although their evaluation ended at `ended_until` or earlier.
pub(crate) async fn with_old_recordings(
    connection: &mut SqliteConnection,
    ended_until: Timestamp,
) -> Result<Vec<RunId>> {
    let runs = sqlx::query_scalar!(
        "SELECT r.id
         FROM runs r JOIN evaluations e ON e.run_id = r.id
         WHERE r.keeps_recordings = 1 AND r.recordings_removed_at IS NULL AND e.finished_at <= ?",
        Instant(ended_until),
    )
    .fetch_all(connection)
    .await?;
    Ok(runs)
}

pub(crate) async fn set_recordings_removed(
    connection: &mut SqliteConnection,
    id: RunId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE runs SET recordings_removed_at = ? WHERE id = ?",
        Instant(now),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The runs whose shards are stored although their owner ended at `ended_until` or earlier, the oldest first, without the
/// completed ones that have no summary.
pub(crate) async fn clearable(
    connection: &mut SqliteConnection,
    summary_version: u32,
    ended_until: Timestamp,
) -> Result<Vec<RunId>> {
    Ok(sqlx::query_scalar!(
        r#"SELECT r.id AS "run!"
           FROM runs r LEFT JOIN evaluations e ON e.run_id = r.id
           LEFT JOIN ablation_runs p ON p.run_id = r.id LEFT JOIN ablations a ON a.id = p.ablation_id
           WHERE r.cleared_at IS NULL AND COALESCE(e.finished_at, a.finished_at) <= ?
             AND (r.state <> 'played'
                  OR EXISTS (SELECT 1 FROM episode_summaries s WHERE s.run_id = r.id AND s.version = ?))
           ORDER BY COALESCE(e.finished_at, a.finished_at), r.id"#,
        Instant(ended_until),
        summary_version,
    )
    .fetch_all(connection)
    .await?)
}

/// The completed runs that have ended and still have their shards, but no summary of this version, the oldest first.
pub(crate) async fn unsummarised(
    connection: &mut SqliteConnection,
    summary_version: u32,
) -> Result<Vec<RunId>> {
    Ok(sqlx::query_scalar!(
        r#"SELECT r.id AS "run!"
           FROM runs r LEFT JOIN evaluations e ON e.run_id = r.id
           LEFT JOIN ablation_runs p ON p.run_id = r.id LEFT JOIN ablations a ON a.id = p.ablation_id
           WHERE r.cleared_at IS NULL AND r.state = 'played'
             AND COALESCE(e.finished_at, a.finished_at) IS NOT NULL
             AND NOT EXISTS (SELECT 1 FROM episode_summaries s WHERE s.run_id = r.id AND s.version = ?)
           ORDER BY COALESCE(e.finished_at, a.finished_at), r.id"#,
        summary_version,
    )
    .fetch_all(connection)
    .await?)
}

pub(crate) async fn set_cleared(
    connection: &mut SqliteConnection,
    id: RunId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE runs SET cleared_at = ? WHERE id = ?",
        Instant(now),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// When the run's shards were deleted, if they were.
pub(crate) async fn cleared_at(
    connection: &mut SqliteConnection,
    id: RunId,
) -> Result<Option<Timestamp>> {
    let row = sqlx::query!("SELECT cleared_at AS at FROM runs WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("run"))?;
    Ok(row.at.map(|at| at.0))
}
