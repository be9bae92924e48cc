use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event},
    operations::{
        ends::{self, RunEnd},
        purpose::{self, Purpose},
        runs,
    },
    queue::{self, Claim, Hold},
    store::Store,
    tables::{
        runs as run_rows,
        shards::{self, Shard, ShardCommit},
    },
    write::Tx,
};
use faceoff_types::RunId;
use jiff::Timestamp;

/// What became of a commit. An error in place of one leaves open whether it was stored if it is a
/// database's ([`StoreError::Database`]); after any other nothing was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Committed {
    Now,
    /// This very lease has committed before; nothing was changed.
    Before,
    /// The unit is another worker's, or was dropped; nothing was changed.
    LeaseLost,
}

/// A claim on one kind of work cannot be committed as another.
pub(crate) fn other_work(expected: &str, purpose: &Purpose) -> StoreError {
    StoreError::Conflict(format!(
        "the claim is not on a {expected}, but on {purpose:?}"
    ))
}

impl Store {
    /// Does what a claim is good for, unless it was done under the same lease before or the lease is
    /// lost; then the unit is done.
    pub(crate) async fn commit(
        &self,
        claim: &Claim,
        now: Timestamp,
        commit: impl AsyncFnOnce(&mut Tx, Purpose) -> Result<()>,
    ) -> Result<Committed> {
        let actor = Actor::Worker(claim.worker.clone());
        self.write(actor, now, async |tx| {
            let kind = match queue::hold(tx, claim).await? {
                Hold::Held { kind } => kind,
                Hold::DoneBefore => return Ok(Committed::Before),
                Hold::Lost => return Ok(Committed::LeaseLost),
            };
            let purpose = purpose::of_unit(tx, claim.unit, &kind).await?;
            let progress = match &purpose {
                Purpose::Shard { shard, .. } => shard.episodes(),
                Purpose::Smoke(_)
                | Purpose::Game(_)
                | Purpose::Finalise(_)
                | Purpose::FinaliseDraft { .. } => 0,
            };
            queue::mark_done(tx, claim, progress).await?;
            commit(tx, purpose).await?;
            Ok(Committed::Now)
        })
        .await
    }

    /// Stores a played shard. Idempotent: a second commit under the same lease, or one under a lost
    /// lease, changes nothing and says so. More agent faults than the plan allows, summed over the
    /// run, end an evaluation as [`AgentFailed`](crate::EvaluationState::AgentFailed) and an ablation
    /// without a result; the last shard of an evaluation queues the finalisation, that of an
    /// ablation's last run ends it.
    #[boxed]
    pub async fn commit_shard(
        &self,
        claim: &Claim,
        commit: ShardCommit,
        now: Timestamp,
    ) -> Result<Committed> {
        self.commit(claim, now, async |tx, purpose| match purpose {
            Purpose::Shard { run, shard } => store_shard(tx, run, &shard, &commit).await,
            other => Err(other_work("shard", &other)),
        })
        .await
    }
}

async fn store_shard(tx: &mut Tx, id: RunId, shard: &Shard, commit: &ShardCommit) -> Result<()> {
    let run = run_rows::find(tx, id).await?;
    commit.check(shard, run.keeps_recordings)?;
    let now = tx.now;
    shards::commit(tx, shard.id, commit, now).await?;
    let owner = runs::owner(tx, id).await?;
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
        ends::run_ended(tx, id, owner, RunEnd::AgentFailed).await
    } else if sums.open == 0 {
        ends::run_ended(tx, id, owner, RunEnd::Played).await
    } else {
        Ok(())
    }
}
