//! Commits: a worker stores the result of its job, at most once per lease. The last shard of a run ends the run.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event},
    operations::{
        job_purpose::{self, JobPurpose},
        run_completion::{self, RunEnd},
        runs,
    },
    queue::{self, ClaimState, JobClaim},
    store::Store,
    tables::{
        runs as run_rows,
        shards::{self, Shard, ShardCommit},
    },
    write::Tx,
};
use faceoff_types::RunId;
use jiff::Timestamp;

/// Outcome of a commit. After [`StoreError::Database`] it is unknown whether the result was stored; after any
/// other error nothing was stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommitOutcome {
    Stored,
    /// The same lease has committed before; nothing was changed.
    AlreadyStored,
    /// Another worker holds the lease, or the job was dropped; nothing was changed.
    LeaseLost,
}

/// The error for a claim that is committed with the result of another kind of job.
pub(crate) fn wrong_job(expected: &str, purpose: &JobPurpose) -> StoreError {
    StoreError::Conflict(format!(
        "the claim is not on a {expected}, but on {purpose:?}"
    ))
}

impl Store {
    /// Runs `commit` and marks the job done, unless the same lease has committed before or was lost.
    pub(crate) async fn commit(
        &self,
        claim: &JobClaim,
        now: Timestamp,
        commit: impl AsyncFnOnce(&mut Tx, JobPurpose) -> Result<()>,
    ) -> Result<CommitOutcome> {
        let actor = Actor::Worker(claim.holder.clone());
        self.write(actor, now, async |tx| {
            let kind = match queue::claim_state(tx, claim).await? {
                ClaimState::Leased { kind } => kind,
                ClaimState::AlreadyDone => return Ok(CommitOutcome::AlreadyStored),
                ClaimState::Lost => return Ok(CommitOutcome::LeaseLost),
            };
            let purpose = job_purpose::of_job(tx, claim.job, &kind).await?;
            let progress = match &purpose {
                JobPurpose::Shard { shard, .. } => shard.episodes(),
                JobPurpose::Validation(_) | JobPurpose::Game(_) | JobPurpose::Scoring(_) => 0,
            };
            queue::mark_done(tx, claim, progress).await?;
            commit(tx, purpose).await?;
            Ok(CommitOutcome::Stored)
        })
        .await
    }

    /// Stores the results of a shard (a part of a run's episodes). Idempotent: a second commit under the same lease, or one under a
    /// lost lease, changes nothing; the outcome reports it. If the run has more agent faults than its
    /// plan allows, an evaluation ends as [`AgentFailed`](crate::EvaluationState::AgentFailed) and an
    /// ablation ends without a result. The last shard of an evaluation queues its scoring. The
    /// last shard of all runs of an ablation ends the ablation.
    #[boxed_future]
    pub async fn commit_shard(
        &self,
        claim: &JobClaim,
        commit: ShardCommit,
        now: Timestamp,
    ) -> Result<CommitOutcome> {
        self.commit(claim, now, async |tx, purpose| match purpose {
            JobPurpose::Shard { run, shard } => store_shard(tx, run, &shard, &commit).await,
            other => Err(wrong_job("shard", &other)),
        })
        .await
    }
}

async fn store_shard(tx: &mut Tx, id: RunId, shard: &Shard, commit: &ShardCommit) -> Result<()> {
    let run = run_rows::find(tx, id).await?;
    commit.check(shard, run.keeps_recordings)?;
    let now = tx.now;
    shards::commit(tx, shard.id, commit, now).await?;
    let owner = runs::find_owner(tx, id).await?;
    tx.record(
        owner.subject(),
        Event::ShardCommitted {
            run: id,
            shard: shard.id,
            task: shard.task,
            first_episode: shard.first_episode,
            end_episode: shard.end_episode,
            agent_faults: commit.agent_faults(),
        },
    );
    let sums = shards::sums(tx, id).await?;
    if commit.stopped_by_faults || sums.agent_faults > i64::from(run.plan.max_faults) {
        run_completion::end_run(tx, id, owner, RunEnd::AgentFailed).await
    } else if sums.open == 0 {
        run_completion::end_run(tx, id, owner, RunEnd::Completed).await
    } else {
        Ok(())
    }
}
