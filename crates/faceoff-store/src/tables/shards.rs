//! The table of shards: parts of a run's episodes, each of which is one job.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
};
use faceoff_types::{EpisodeOutcome, RunId, ShardId, Task};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// A range of episodes of one task of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Shard {
    pub id: ShardId,
    pub task: Task,
    /// Index of the episode within the run's task, from 0.
    pub first_episode: u32,
    /// One past the last episode.
    pub end_episode: u32,
    /// Artifact key prefix of its recording, if it is committed and its run is recorded. The artifacts
    /// are removed some time after the end of the evaluation.
    pub recording: Option<String>,
}

impl Shard {
    /// Number of its episodes.
    #[must_use]
    pub const fn episodes(&self) -> u32 {
        self.end_episode - self.first_episode
    }
}

/// The result of playing a shard, as committed by a worker.
#[derive(Debug, Clone, PartialEq)]
pub struct ShardCommit {
    /// One outcome per episode, in order; fewer only if the shard was stopped by faults.
    pub outcomes: Vec<EpisodeOutcome>,
    /// The stored part of the agent's standard error: its beginning and its end.
    pub log: String,
    /// Was the shard stopped because the agent's faults in it exceeded the plan's limit?
    pub stopped_by_faults: bool,
    /// Artifact key prefix of the recording, which is stored already; `None` exactly if the run is not recorded.
    pub recording: Option<String>,
}

impl ShardCommit {
    /// Refuses a commit that does not cover its shard: the score would be based on fewer episodes.
    pub(crate) fn check(&self, shard: &Shard, keeps_recordings: bool) -> Result<()> {
        let episodes = shard.first_episode..shard.end_episode;
        let is_in_order = self
            .outcomes
            .iter()
            .zip(episodes.clone())
            .all(|(outcome, episode)| outcome.task == shard.task && outcome.episode == episode);
        let is_complete = self.outcomes.len() == episodes.len()
            || (self.stopped_by_faults && self.outcomes.len() < episodes.len());
        if !(is_in_order && is_complete) {
            return StoreError::conflict(format!(
                "the outcomes do not cover {} episodes {} to {}",
                shard.task,
                shard.first_episode,
                shard.end_episode - 1
            ));
        }
        match (&self.recording, keeps_recordings) {
            (Some(_), true) | (None, false) => Ok(()),
            (None, true) => StoreError::conflict(
                "the run keeps recordings: upload the shard's and name its key",
            ),
            (Some(key), false) => StoreError::conflict(format!(
                "the run keeps no recordings: do not upload one (got {key})"
            )),
        }
    }

    pub(crate) fn agent_faults(&self) -> u32 {
        let faults = self
            .outcomes
            .iter()
            .filter(|outcome| outcome.fault.is_some())
            .count();
        u32::try_from(faults).unwrap_or(u32::MAX)
    }
}

struct ShardRow {
    id: ShardId,
    run: RunId,
    task: Task,
    first_episode: u32,
    end_episode: u32,
    recording: Option<String>,
}

impl From<ShardRow> for Shard {
    fn from(row: ShardRow) -> Self {
        Self {
            id: row.id,
            task: row.task,
            first_episode: row.first_episode,
            end_episode: row.end_episode,
            recording: row.recording,
        }
    }
}

/// `SELECT` of shards without outcomes and logs; the argument is the SQL after `FROM shards`.
macro_rules! select_shards {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            ShardRow,
            "SELECT id, run_id AS run, task, first_episode, end_episode, recording
             FROM shards " + $tail
            $(, $argument)*
        )
    };
}

/// The shard that a job plays, and its run.
pub(crate) async fn of_job(
    connection: &mut SqliteConnection,
    job: Uuid,
) -> Result<Option<(RunId, Shard)>> {
    Ok(select_shards!("WHERE job_id = ?", Text(job))
        .fetch_optional(connection)
        .await?
        .map(|row| (row.run, row.into())))
}

/// A shard that a worker has committed.
#[derive(Debug)]
pub(crate) struct CommittedShard {
    pub(crate) id: ShardId,
    pub(crate) job: Uuid,
    pub(crate) recording: Option<String>,
}

/// The shards of running runs that a remote worker has committed; as lease holder (`holder`) it is named `remote/WORKER`.
pub(crate) async fn committed_by_worker(
    connection: &mut SqliteConnection,
    holder: &str,
) -> Result<Vec<CommittedShard>> {
    let rows = sqlx::query!(
        "SELECT s.id, s.job_id AS job, s.recording
         FROM jobs j JOIN shards s ON s.job_id = j.id JOIN runs r ON r.id = s.run_id
         -- 0 is what follows / among characters
         WHERE j.state = 'done' AND j.worker >= 'remote/' AND j.worker < 'remote0'
           AND j.worker >= ?1 || '/' AND j.worker < ?1 || '0'
           AND r.state = 'running' AND s.committed_at IS NOT NULL",
        holder,
    )
    .fetch_all(connection)
    .await?;
    let committed = rows.into_iter().map(|row| CommittedShard {
        id: row.id,
        job: row.job.0,
        recording: row.recording,
    });
    Ok(committed.collect())
}

/// Deletes the result of a committed shard.
pub(crate) async fn clear_result(connection: &mut SqliteConnection, id: ShardId) -> Result<()> {
    sqlx::query!(
        "UPDATE shards SET committed_at = NULL, recording = NULL, agent_faults = NULL, outcomes = NULL, log = NULL
         WHERE id = ?",
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The shards of a run, by task and first episode.
pub(crate) async fn of_run(connection: &mut SqliteConnection, run: RunId) -> Result<Vec<Shard>> {
    let shards = select_shards!("WHERE run_id = ? ORDER BY position", run)
        .fetch_all(connection)
        .await?;
    Ok(shards.into_iter().map(Shard::from).collect())
}

/// The jobs of a run's shards that are not committed.
pub(crate) async fn open_jobs(connection: &mut SqliteConnection, run: RunId) -> Result<Vec<Uuid>> {
    let jobs = sqlx::query_scalar!(
        "SELECT job_id AS id FROM shards WHERE run_id = ? AND committed_at IS NULL",
        run,
    )
    .fetch_all(connection)
    .await?;
    Ok(jobs.into_iter().map(|id| id.0).collect())
}

/// Adds a shard at its `position` in the run, with the job that plays it.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    run: RunId,
    shard: &Shard,
    position: u32,
    job: Uuid,
) -> Result<()> {
    sqlx::query!(
        "INSERT INTO shards (id, run_id, job_id, position, task, first_episode, end_episode)
         VALUES (?, ?, ?, ?, ?, ?, ?)",
        shard.id,
        run,
        Text(job),
        position,
        shard.task,
        shard.first_episode,
        shard.end_episode,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Stores the result of a shard that is not committed yet.
pub(crate) async fn commit(
    connection: &mut SqliteConnection,
    id: ShardId,
    commit: &ShardCommit,
    now: Timestamp,
) -> Result<()> {
    let agent_faults = commit.agent_faults();
    let stored = sqlx::query!(
        "UPDATE shards SET committed_at = ?, recording = ?, outcomes = ?, agent_faults = ?, log = ?
         WHERE id = ? AND committed_at IS NULL",
        Instant(now),
        commit.recording,
        Json(&commit.outcomes),
        agent_faults,
        commit.log,
        id,
    )
    .execute(connection)
    .await?;
    match stored.rows_affected() {
        1 => Ok(()),
        _ => Err(StoreError::Damaged(format!(
            "shard {id}: committed, but its job is open"
        ))),
    }
}

/// Sums over a run's shards.
pub(crate) struct ShardSums {
    pub(crate) agent_faults: i64,
    /// Number of shards that are not committed.
    pub(crate) open: i64,
}

pub(crate) async fn sums(connection: &mut SqliteConnection, run: RunId) -> Result<ShardSums> {
    Ok(sqlx::query_as!(
        ShardSums,
        r#"SELECT COALESCE(SUM(agent_faults), 0) AS "agent_faults!: i64", COUNT(*) - COUNT(committed_at) AS "open!: i64"
           FROM shards WHERE run_id = ?"#,
        run,
    )
    .fetch_one(connection)
    .await?)
}

/// The outcomes of a run's committed shards, by task and episode.
pub(crate) async fn outcomes(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Vec<EpisodeOutcome>> {
    let shards = sqlx::query_scalar!(
        r#"SELECT outcomes AS "outcomes!" FROM shards
           WHERE run_id = ? AND outcomes IS NOT NULL ORDER BY position"#,
        run,
    )
    .fetch_all(connection)
    .await?;
    Ok(shards.into_iter().flat_map(|outcomes| outcomes.0).collect())
}

/// A committed shard with agent faults.
pub(crate) struct FaultyShard {
    pub(crate) task: Task,
    pub(crate) first_episode: u32,
    pub(crate) outcomes: Json<Vec<EpisodeOutcome>>,
    pub(crate) log: String,
}

/// The shards of a run with agent faults, in order of play.
pub(crate) async fn with_agent_faults(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Vec<FaultyShard>> {
    Ok(sqlx::query_as!(
        FaultyShard,
        r#"SELECT task, first_episode, outcomes AS "outcomes!", log AS "log!"
           FROM shards WHERE run_id = ? AND agent_faults > 0 ORDER BY position"#,
        run,
    )
    .fetch_all(connection)
    .await?)
}

/// Deletes a run's shards without agent faults, committed or not, with their jobs.
pub(crate) async fn delete_without_faults(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<()> {
    let jobs = sqlx::query_scalar!(
        "DELETE FROM shards WHERE run_id = ? AND COALESCE(agent_faults, 0) = 0
         RETURNING job_id AS job",
        run,
    )
    .fetch_all(&mut *connection)
    .await?;
    let jobs = Json(jobs.iter().map(|job| job.0).collect::<Vec<_>>());
    sqlx::query!(
        "DELETE FROM jobs WHERE id IN (SELECT value FROM json_each(?))",
        jobs
    )
    .execute(connection)
    .await?;
    Ok(())
}
