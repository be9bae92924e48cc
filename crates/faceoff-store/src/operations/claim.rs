use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Subject},
    operations::{
        ends,
        give_back::give_up,
        purpose::{self, Lot, Purpose},
        runs,
        tournament::play,
        work::{Claimed, RunSeeds, Work},
    },
    queue::{self, Claim, Leased},
    store::Store,
    tables::{
        evaluations, runs as run_rows,
        runs::Run,
        season, shards, stage_runtimes, stages,
        submissions::{self, Submission},
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, RunId, SubmissionId};
use jiff::{SignedDuration, Timestamp};
use uuid::Uuid;

/// Leases of one unit after which it is given up although no worker reported a failure: something in
/// it kills its worker. Far above [`MAX_ATTEMPTS`](crate::MAX_ATTEMPTS), since a server that is killed
/// again and again for other reasons must not cost a team its evaluation.
pub const MAX_LEASES: u32 = 50;

impl Store {
    /// Leases the next unit of work for `lease_s` seconds. Finalisations come first; smoke runs and
    /// shards of evaluations share the slots half and half, and the teams that wait for either share
    /// that half equally, by slot time; shards of ablations have what is left. A unit whose lease is
    /// over is leased again. `None`: nothing to do now (see [`Store::work_signal`]), or the queue is paused.
    #[boxed]
    pub async fn claim(
        &self,
        worker: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<Option<Claimed>> {
        self.claim_of(Lot::All, worker, lease_s, now).await
    }

    /// [`claim`](Self::claim), of some of the work alone.
    #[boxed]
    pub async fn claim_of(
        &self,
        lot: Lot,
        worker: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<Option<Claimed>> {
        let actor = Actor::Worker(worker.to_owned());
        self.write(actor, now, async |tx| {
            if season::is_paused(tx).await? {
                return Ok(None);
            }
            let nonce = Uuid::now_v7();
            while let Some(unit) =
                queue::claim_next(tx, worker, nonce, lot.lanes(), lease_s, now).await?
            {
                let reason = if unit.attempts > MAX_LEASES {
                    format!("{MAX_LEASES} workers died over it")
                } else {
                    match describe(tx, &unit, worker).await {
                        Ok(None) => {
                            queue::park(tx, unit.id.0).await?;
                            continue;
                        }
                        Ok(Some(work)) => {
                            let lease = SignedDuration::from_secs(lease_s.into());
                            let claim = Claim {
                                unit: unit.id.0,
                                nonce,
                                worker: worker.to_owned(),
                                lease_until: now.saturating_add(lease).unwrap_or(Timestamp::MAX),
                            };
                            return Ok(Some(Claimed { claim, work }));
                        }
                        // Given up rather than returned: it would be the next claim's unit again, and
                        // nobody else's work would ever be done.
                        Err(StoreError::Damaged(what)) => {
                            tracing::error!(unit = %unit.id.0, what, "damaged work is given up");
                            "a stored value is damaged".to_owned()
                        }
                        Err(error) => return Err(error),
                    }
                };
                give_up(tx, unit.id.0, &unit.kind, &reason).await?;
            }
            Ok(None)
        })
        .await
    }
}

/// Reads what the leased unit is about. `None`: it is not to be begun now.
async fn describe(tx: &mut Tx, unit: &Leased, worker: &str) -> Result<Option<Work>> {
    let retries = unit.attempts.saturating_sub(1);
    let work = match purpose::of_unit(tx, unit.id.0, &unit.kind).await? {
        Purpose::Game(id) => {
            tx.advanced(Subject::Game(id));
            return play::begin(tx, id, worker, retries).await;
        }
        Purpose::Smoke(id) => {
            tx.advanced(Subject::Submission(id));
            let submission = submissions::find(tx, id).await?;
            let secret = season::read(tx).await?.secret;
            let seeds = RunSeeds {
                episodes: secret.smoke(id),
                mismatch: secret.model_mismatch(),
            };
            let all = stages::all(tx).await?;
            let limits = stages::current(&all, tx.now)
                .map(|stage| stage.rules.rules.limits.clone())
                .unwrap_or_default();
            let runtimes = stage_runtimes::of_uploads(&all, tx.now);
            Ok(Work::Smoke {
                submission,
                seeds,
                limits,
                runtimes,
            })
        }
        Purpose::Shard { run: id, shard } => {
            let owner = runs::owner(tx, id).await?;
            let (run, seeds) = read_run(tx, id).await?;
            let submission = contestant(tx, id).await?;
            ends::run_begun(tx, id, owner).await?;
            tx.advanced(owner.subject());
            Ok(Work::Shard {
                owner,
                run,
                shard,
                bundle: submission.bundle,
                seeds,
                platform_retries: retries,
            })
        }
        Purpose::Finalise(evaluation) => {
            tx.advanced(Subject::Evaluation(evaluation));
            let run = evaluations::run_of(tx, evaluation).await?;
            finalise(tx, evaluation, run).await
        }
        Purpose::FinaliseDraft { id, run, proposal } => {
            tx.advanced(Subject::Proposal(proposal));
            finalise(tx, id, run).await
        }
    };
    work.map(Some)
}

async fn finalise(tx: &mut Tx, evaluation: EvaluationId, id: RunId) -> Result<Work> {
    let (run, seeds) = read_run(tx, id).await?;
    let of_run = shards::of_run(tx, id).await?;
    let missing = |what| StoreError::Damaged(format!("evaluation {evaluation}: {what}"));
    let recordings: Option<Vec<_>> = of_run.into_iter().map(|shard| shard.recording).collect();
    let agent_name = contestant(tx, id).await?.agent_name;
    Ok(Work::Finalise {
        evaluation,
        run,
        recordings: recordings.ok_or_else(|| missing("a shard without a recording"))?,
        agent_name: agent_name.ok_or_else(|| missing("an agent without a name"))?,
        seeds,
    })
}

async fn read_run(tx: &mut Tx, id: RunId) -> Result<(Run, RunSeeds)> {
    let run = run_rows::find(tx, id).await?;
    let secret = season::read(tx).await?.secret;
    let seeds = RunSeeds {
        episodes: run.seed.seed(&secret),
        mismatch: secret.model_mismatch(),
    };
    Ok((run, seeds))
}

/// The one that plays a run of tasks.
async fn contestant(tx: &mut Tx, run: RunId) -> Result<Submission> {
    let sides: Vec<SubmissionId> = run_rows::contestants(tx, run).await?;
    match sides[..] {
        [submission] => submissions::find(tx, submission).await,
        _ => Err(StoreError::Damaged(format!(
            "run {run}: {} contestants, where its tasks are for one",
            sides.len()
        ))),
    }
}
