//! Claims of jobs: a worker gets the next job of the queue under a lease, with everything that it needs to run the job. A
//! job is a validation run of an upload, a shard (a part of a run's episodes), a scoring, or a game.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Subject},
    operations::{
        job_purpose::{self, JobFilter, JobPurpose},
        jobs::{ClaimedJob, Job, RunSeeds},
        lease_release::give_up,
        run_completion, runs,
        tournament::game_lifecycle,
    },
    queue::{self, JobClaim, LeasedJob},
    store::Store,
    tables::{
        runs as run_rows,
        runs::Run,
        season, shards, stage_runtimes,
        stages::{self, StagePhase},
        submissions::{self, Submission},
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, RunId, SubmissionId};
use jiff::{SignedDuration, Timestamp};
use uuid::Uuid;

/// Number of leases of one job after which it is given up although no worker reported a failure: something in
/// it kills its worker. The number is far above [`MAX_PLATFORM_FAULTS`](crate::MAX_PLATFORM_FAULTS): a server that is killed
/// repeatedly for other reasons must not cost a team its evaluation.
pub const MAX_LEASES: u32 = 50;

impl Store {
    /// Leases the next job for `lease_s` seconds. Scoring comes first. Validation runs, shards of evaluations and games of rounds
    /// share the slots (places for one job) equally; within each of these three kinds, teams get equal slot time. Ablations,
    /// proposals and other games get the remaining slots. A job with an expired lease is leased again. `None`: there is no job to
    /// run now (see [`Store::job_signal`]), or the queue is paused.
    #[boxed_future]
    pub async fn claim(
        &self,
        worker: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<Option<ClaimedJob>> {
        self.claim_matching(JobFilter::All, worker, lease_s, now)
            .await
    }

    /// [`claim`](Self::claim), limited to some kinds of jobs.
    #[boxed_future]
    pub async fn claim_matching(
        &self,
        filter: JobFilter,
        worker: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<Option<ClaimedJob>> {
        let actor = Actor::Worker(worker.to_owned());
        self.write(actor, now, async |tx| {
            if season::is_paused(tx).await? {
                return Ok(None);
            }
            let nonce = Uuid::now_v7();
            while let Some(leased) =
                queue::claim_next(tx, worker, nonce, filter.lanes(), lease_s, now).await?
            {
                let reason = if leased.attempts > MAX_LEASES {
                    format!("{MAX_LEASES} workers died while running it")
                } else {
                    match describe_job(tx, &leased, worker).await {
                        // A game of a paused tournament: it waits, without a lease, until the tournament is resumed.
                        Ok(None) => {
                            queue::park(tx, leased.id.0).await?;
                            continue;
                        }
                        Ok(Some(job)) => {
                            if leased.attempts > 1 {
                                // The end of a lease is not logged: this line shows that a job runs once more.
                                tracing::info!(job = %leased.id.0, attempt = leased.attempts, "a job is leased again");
                            }
                            let lease = SignedDuration::from_secs(lease_s.into());
                            let claim = JobClaim {
                                job: leased.id.0,
                                nonce,
                                holder: worker.to_owned(),
                                lease_until: now.saturating_add(lease).unwrap_or(Timestamp::MAX),
                            };
                            return Ok(Some(ClaimedJob { claim, job }));
                        }
                        // Given up rather than returned: the next claim would lease it again, and
                        // no other job would ever be run.
                        Err(StoreError::Damaged(defect)) => {
                            tracing::error!(job = %leased.id.0, defect, "a damaged job is given up");
                            "a stored value is damaged".to_owned()
                        }
                        Err(error) => return Err(error),
                    }
                };
                give_up(tx, leased.id.0, &leased.kind, &reason).await?;
            }
            Ok(None)
        })
        .await
    }
}

/// Reads the rows that a leased job refers to. `None`: the job must not start now, because its tournament is paused.
async fn describe_job(tx: &mut Tx, leased: &LeasedJob, worker: &str) -> Result<Option<Job>> {
    let retries = leased.attempts.saturating_sub(1);
    let job = match job_purpose::of_job(tx, leased.id.0, &leased.kind).await? {
        JobPurpose::Game(id) => {
            tx.record_progress(Subject::Game(id));
            return game_lifecycle::begin(tx, id, worker, retries).await;
        }
        JobPurpose::Validation(id) => {
            tx.record_progress(Subject::Submission(id));
            let submission = submissions::find(tx, id).await?;
            let secret = season::read(tx).await?.secret;
            let seeds = RunSeeds {
                episodes: secret.validation(id),
                mismatch: secret.model_mismatch(),
            };
            let all = stages::all(tx).await?;
            let ruleset_and_plan = stages::current(&all, tx.now).map(|stage| {
                let mut plan = stage.plan();
                // The submission can be evaluated in other stages, too. Each task has an agent of its own, which does not see the others.
                let others = all
                    .iter()
                    .filter(|other| other.phase(tx.now) != StagePhase::Closed);
                for task in others.flat_map(|other| &other.revision.rules.tasks) {
                    if !plan.tasks.contains(task) {
                        plan.tasks.push(*task);
                    }
                }
                Box::new((stage.revision.rules.ruleset, plan))
            });
            let runtimes = stage_runtimes::required_runtimes(&all, tx.now);
            Ok(Job::Validation {
                submission,
                seeds,
                ruleset_and_plan,
                runtimes,
            })
        }
        JobPurpose::Shard { run: id, shard } => {
            let owner = runs::find_owner(tx, id).await?;
            let (run, seeds) = read_run(tx, id).await?;
            let submission = single_contestant(tx, id).await?;
            run_completion::record_run_start(tx, id, owner).await?;
            tx.record_progress(owner.subject());
            Ok(Job::Shard {
                owner,
                run,
                shard,
                bundle: submission.bundle,
                seeds,
                platform_retries: retries,
            })
        }
        JobPurpose::Scoring(evaluation) => {
            tx.record_progress(evaluation.owner().subject());
            describe_scoring(tx, evaluation.id, evaluation.run).await
        }
    };
    job.map(Some)
}

async fn describe_scoring(tx: &mut Tx, evaluation: EvaluationId, id: RunId) -> Result<Job> {
    let (run, seeds) = read_run(tx, id).await?;
    let shards_of_run = shards::of_run(tx, id).await?;
    let damaged = |defect| StoreError::Damaged(format!("evaluation {evaluation}: {defect}"));
    let recordings: Option<Vec<_>> = shards_of_run
        .into_iter()
        .map(|shard| shard.recording)
        .collect();
    let agent_name = single_contestant(tx, id).await?.agent_name;
    Ok(Job::Scoring {
        evaluation,
        run,
        recordings: recordings.ok_or_else(|| damaged("a shard without a recording"))?,
        agent_name: agent_name.ok_or_else(|| damaged("an agent without a name"))?,
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

/// The submission of a run. A run has exactly one, although the table of contestants could hold several.
async fn single_contestant(tx: &mut Tx, run: RunId) -> Result<Submission> {
    let contestants: Vec<SubmissionId> = run_rows::contestants(tx, run).await?;
    match contestants[..] {
        [submission] => submissions::find(tx, submission).await,
        _ => Err(StoreError::Damaged(format!(
            "run {run}: expected one contestant, found {}",
            contestants.len()
        ))),
    }
}
