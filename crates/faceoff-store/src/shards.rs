use crate::{
    Claim, Committed, EvaluationPlan, Event, Store, StoreError,
    column::{Instant, Json},
    evaluation_ends, evaluations,
    leases::{self, Hold},
    queue,
};
use faceoff_types::{EpisodeOutcome, EvaluationId, ShardId, SubmissionId, Task};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// A range of episodes of one task of one evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Shard {
    /// Its id.
    pub id: ShardId,
    /// The task.
    pub task: Task,
    /// The first episode.
    pub first_episode: u32,
    /// One past the last episode.
    pub end_episode: u32,
    /// Artifact key prefix of its recording, once committed. Its artifacts are removed some time
    /// after the evaluation is over.
    pub recording: Option<String>,
}

/// What playing a shard yields.
#[derive(Debug, Clone, PartialEq)]
pub struct ShardCommit {
    /// One outcome per episode, in order; fewer only if the shard was stopped by faults.
    pub outcomes: Vec<EpisodeOutcome>,
    /// Tail of the agent's standard error.
    pub log: String,
    /// The agent's faults exceeded the plan's bound within this shard.
    pub stopped_by_faults: bool,
    /// Artifact key prefix of the recording, uploaded before.
    pub recording: String,
}

impl ShardCommit {
    /// A commit that does not cover its shard would publish a score of fewer episodes.
    fn check(&self, shard: &Shard) -> Result<(), StoreError> {
        let episodes = shard.first_episode..shard.end_episode;
        let in_order = self
            .outcomes
            .iter()
            .zip(episodes.clone())
            .all(|(outcome, episode)| outcome.task == shard.task && outcome.episode == episode);
        let complete = self.outcomes.len() == episodes.len()
            || (self.stopped_by_faults && self.outcomes.len() < episodes.len());
        if in_order && complete {
            Ok(())
        } else {
            Err(StoreError::Conflict(format!(
                "the outcomes do not cover {} episodes {} to {}",
                shard.task,
                shard.first_episode,
                shard.end_episode - 1
            )))
        }
    }

    fn agent_faults(&self) -> u32 {
        let faults = self
            .outcomes
            .iter()
            .filter(|outcome| outcome.fault.is_some())
            .count();
        u32::try_from(faults).unwrap_or(u32::MAX)
    }
}

/// Artifact key prefix of all recordings of an evaluation.
pub(crate) fn recordings_of(evaluation: EvaluationId) -> String {
    format!("recordings/{evaluation}")
}

impl Claim {
    /// Artifact key prefix for the recording made under this lease. Every lease has its own, so that
    /// a worker that lost one never mixes its files with its successor's.
    #[must_use]
    pub fn recording_key(&self, evaluation: EvaluationId) -> String {
        format!("{}/{}/{}", recordings_of(evaluation), self.unit, self.nonce)
    }
}

struct ShardRow {
    id: Text<ShardId>,
    task: Text<Task>,
    first_episode: u32,
    end_episode: u32,
    recording: Option<String>,
}

impl From<ShardRow> for Shard {
    fn from(row: ShardRow) -> Self {
        Self {
            id: row.id.0,
            task: row.task.0,
            first_episode: row.first_episode,
            end_episode: row.end_episode,
            recording: row.recording,
        }
    }
}

/// `SELECT` of whole shards; the argument is what follows `FROM shards`.
macro_rules! select_shards {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            ShardRow,
            r#"SELECT id AS "id: Text<ShardId>", task AS "task: Text<Task>",
                      first_episode AS "first_episode: u32", end_episode AS "end_episode: u32",
                      recording
               FROM shards "# + $tail
            $(, $argument)*
        )
    };
}

/// Reads one shard.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: ShardId,
) -> Result<Shard, StoreError> {
    let id = Text(id);
    Ok(select_shards!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("shard"))?
        .into())
}

/// Cuts a new evaluation into shards, in (task, first episode) order, and queues them.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
    submission: SubmissionId,
    plan: &EvaluationPlan,
    now: Timestamp,
) -> Result<(), StoreError> {
    let (evaluation, submission, now) = (Text(evaluation), Text(submission), Instant(now));
    let mut tasks = plan.tasks.clone();
    tasks.sort_unstable();
    let mut position = 0_u32;
    for task in tasks {
        let mut first = 0;
        while first < plan.episodes_per_task {
            let end = plan
                .episodes_per_task
                .min(first.saturating_add(plan.episodes_per_shard));
            let (id, task) = (Text(ShardId::new()), Text(task));
            sqlx::query!(
                "INSERT INTO shards (id, evaluation_id, position, task, first_episode, end_episode)
                 VALUES (?, ?, ?, ?, ?, ?)",
                id,
                evaluation,
                position,
                task,
                first,
                end,
            )
            .execute(&mut *connection)
            .await?;
            sqlx::query!(
                "INSERT INTO work_units (id, kind, submission_id, evaluation_id, shard_id, state,
                                         claimable_at)
                 VALUES (?1, 'shard', ?2, ?3, ?1, 'queued', ?4)",
                id,
                submission,
                evaluation,
                now,
            )
            .execute(&mut *connection)
            .await?;
            position += 1;
            first = end;
        }
    }
    Ok(())
}

impl Store {
    /// The shards of an evaluation in (task, first episode) order, with recording keys.
    pub async fn shards(&self, evaluation: EvaluationId) -> Result<Vec<Shard>, StoreError> {
        let evaluation = Text(evaluation);
        let shards = select_shards!("WHERE evaluation_id = ? ORDER BY position", evaluation)
            .fetch_all(&self.database.read)
            .await?;
        Ok(shards.into_iter().map(Shard::from).collect())
    }

    /// The outcomes of an evaluation's committed shards in (task, episode) order: all that scoring
    /// needs, without opening a recording.
    pub async fn outcomes(
        &self,
        evaluation: EvaluationId,
    ) -> Result<Vec<EpisodeOutcome>, StoreError> {
        let evaluation = Text(evaluation);
        let shards = sqlx::query_scalar!(
            r#"SELECT outcomes AS "outcomes!: Json<Vec<EpisodeOutcome>>" FROM shards
               WHERE evaluation_id = ? AND outcomes IS NOT NULL ORDER BY position"#,
            evaluation,
        )
        .fetch_all(&self.database.read)
        .await?;
        Ok(shards.into_iter().flat_map(|outcomes| outcomes.0).collect())
    }

    /// Stores a played shard. Idempotent: a second commit under the same lease, or one under a lost
    /// lease, changes nothing and says so. With more agent faults than the plan allows, summed over
    /// the evaluation, it ends as [`AgentFailed`](crate::EvaluationState::AgentFailed); the last
    /// shard queues the finalisation.
    pub async fn commit_shard(
        &self,
        claim: &Claim,
        commit: ShardCommit,
        now: Timestamp,
    ) -> Result<Committed, StoreError> {
        let mut tx = self.database.begin().await?;
        let unit = match leases::hold(&mut tx, claim).await? {
            Hold::Held(unit) => unit,
            Hold::DoneBefore => return Ok(Committed::Before),
            Hold::Lost => return Ok(Committed::LeaseLost),
        };
        let evaluation = unit.evaluation_of("shard")?;
        let shard = find(&mut tx, unit.shard()?).await?;
        commit.check(&shard)?;
        leases::mark_done(&mut tx, claim, shard.end_episode - shard.first_episode).await?;
        store_commit(&mut tx, shard.id, &commit, now).await?;

        let (id, plan) = (
            Text(evaluation),
            evaluations::find(&mut tx, evaluation).await?.plan,
        );
        let sums = sqlx::query!(
            r#"SELECT COALESCE(SUM(agent_faults), 0) AS "agent_faults!: i64",
                      COUNT(*) - COUNT(committed_at) AS "open!: i64"
               FROM shards WHERE evaluation_id = ?"#,
            id,
        )
        .fetch_one(&mut *tx)
        .await?;
        let failed = commit.stopped_by_faults || sums.agent_faults > i64::from(plan.max_faults);
        let complete = !failed && sums.open == 0;
        if failed {
            evaluation_ends::fail_agent(&mut tx, evaluation, now).await?;
        } else if complete {
            queue::insert_finalise(&mut tx, evaluation, unit.submission, now).await?;
        }
        tx.commit().await?;
        if complete {
            self.signals.work_added();
        }
        self.signals.changed(Event::Evaluation(evaluation));
        Ok(Committed::Now)
    }
}

async fn store_commit(
    connection: &mut SqliteConnection,
    shard: ShardId,
    commit: &ShardCommit,
    now: Timestamp,
) -> Result<(), StoreError> {
    let (id, now, outcomes) = (Text(shard), Instant(now), Json(&commit.outcomes));
    let agent_faults = commit.agent_faults();
    let stored = sqlx::query!(
        "UPDATE shards SET committed_at = ?, recording = ?, outcomes = ?, agent_faults = ?, log = ?
         WHERE id = ? AND committed_at IS NULL",
        now,
        commit.recording,
        outcomes,
        agent_faults,
        commit.log,
        id,
    )
    .execute(connection)
    .await?;
    if stored.rows_affected() == 1 {
        Ok(())
    } else {
        Err(StoreError::Damaged(format!(
            "shard {shard}: committed, but its unit of work is open"
        )))
    }
}
