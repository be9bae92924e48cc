//! Release of leases: a job that a worker does not complete returns to the queue, or is given up. Failures by a platform
//! fault (a fault of the server or a worker, not of the agent) are counted. Other releases do not count as attempts.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        job_purpose::{self, JobPurpose},
        run_completion::{self, RunEnd},
        runs,
        tournament::game_lifecycle,
    },
    queue::{self, ClaimState, JobClaim, ReleaseCause},
    store::Store,
    tables::{evaluations::Failure, game_attempts::AttemptOutcome, submissions},
    write::Tx,
};
use jiff::Timestamp;
use sqlx::SqliteConnection;
use uuid::Uuid;

/// Number of platform faults after which a job is given up.
pub const MAX_PLATFORM_FAULTS: u32 = 5;

/// Pause before a job that met a full disk is run again, seconds. Without it a job that needs more disk
/// space than there is would take up every slot.
const FULL_DISK_DELAY_S: u32 = 10;

/// The subject of a job's events.
pub(crate) async fn event_subject(
    connection: &mut SqliteConnection,
    purpose: &JobPurpose,
) -> Result<Subject> {
    Ok(match purpose {
        JobPurpose::Validation(id) => Subject::Submission(*id),
        JobPurpose::Game(id) => Subject::Game(*id),
        JobPurpose::Shard { run, .. } => runs::find_owner(connection, *run).await?.subject(),
        JobPurpose::Scoring(evaluation) => evaluation.owner().subject(),
    })
}

/// Drops a job after platform faults, and ends what it belongs to: a validation run, a run, a scoring or a game.
pub(crate) async fn give_up(tx: &mut Tx, job: Uuid, stored_kind: &str, reason: &str) -> Result<()> {
    queue::drop_jobs(tx, &[job]).await?;
    match job_purpose::of_job(tx, job, stored_kind).await {
        Ok(JobPurpose::Validation(id)) => {
            submissions::set_validation_error(tx, id, reason).await?;
            let reason = reason.to_owned();
            tx.record(
                Subject::Submission(id),
                Event::SubmissionNotValidated { reason },
            );
            Ok(())
        }
        Ok(JobPurpose::Game(id)) => game_lifecycle::give_up(tx, id, reason).await,
        Ok(JobPurpose::Shard { run, .. }) => {
            let owner = runs::find_owner(tx, run).await?;
            run_completion::end_run(tx, run, owner, RunEnd::PlatformFailed(reason)).await
        }
        Ok(JobPurpose::Scoring(evaluation)) => {
            run_completion::fail_evaluation(tx, evaluation.id, Failure::Platform(reason)).await
        }
        // No row refers to the job, so there is nothing to end.
        Err(StoreError::Damaged(_)) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Puts a leased job back into the queue; the attempt does not count.
async fn requeue_leased(
    tx: &mut Tx,
    claim: &JobClaim,
    kind: &str,
    delay_s: u32,
    cause: ReleaseCause,
) -> Result<()> {
    queue::release(tx, claim, delay_s, cause).await?;
    let purpose = job_purpose::of_job(tx, claim.job, kind).await?;
    if let JobPurpose::Game(id) = purpose {
        game_lifecycle::end_attempt(tx, id, AttemptOutcome::Released, None).await?;
    }
    let subject = event_subject(tx, &purpose).await?;
    tx.record_progress(subject);
    Ok(())
}

/// Puts all jobs leased by `holder`, and by every name `holder/…`, back into the queue; the attempts do not count. Results
/// that arrive later are refused, because their lease is lost.
pub(crate) async fn requeue_leases_of(tx: &mut Tx, holder: &str) -> Result<u64> {
    let leases = queue::leases(tx, holder).await?;
    for (claim, kind) in &leases {
        requeue_leased(tx, claim, kind, 0, ReleaseCause::Interrupted).await?;
    }
    Ok(u64::try_from(leases.len()).unwrap_or(u64::MAX))
}

impl Store {
    /// Releases a job after a platform fault: it returns to the queue after a growing pause. After
    /// [`MAX_PLATFORM_FAULTS`] failures an evaluation ends as
    /// [`PlatformFailed`](crate::EvaluationState::PlatformFailed) and is rerun a limited number of times
    /// ([`RERUN_PAUSES_S`](crate::RERUN_PAUSES_S)). A validation run ends as
    /// [`PlatformFailed`](crate::SubmissionState::PlatformFailed), an ablation ends without a result. For a lost lease
    /// nothing is recorded.
    #[boxed_future]
    pub async fn release_after_platform_fault(
        &self,
        claim: &JobClaim,
        reason: &str,
        now: Timestamp,
    ) -> Result<()> {
        let actor = Actor::Worker(claim.holder.clone());
        self.write(actor, now, async |tx| {
            let ClaimState::Leased { kind } = queue::claim_state(tx, claim).await? else {
                return Ok(());
            };
            let purpose = job_purpose::of_job(tx, claim.job, &kind).await?;
            let failures = queue::requeue_failed(tx, claim, now).await?;
            let event = Event::JobFailed {
                job: claim.job,
                failures,
                reason: reason.to_owned(),
            };
            let subject = event_subject(tx, &purpose).await?;
            tx.record(subject, event);
            if let JobPurpose::Game(id) = purpose {
                game_lifecycle::end_attempt(tx, id, AttemptOutcome::PlatformFailed, Some(reason))
                    .await?;
            }
            if failures >= MAX_PLATFORM_FAULTS {
                give_up(tx, claim.job, &kind, reason).await?;
            }
            Ok(())
        })
        .await
    }

    /// Releases a job at once, on shutdown; the attempt does not count. For a lost lease nothing is
    /// recorded.
    #[boxed_future]
    pub async fn release(&self, claim: &JobClaim, now: Timestamp) -> Result<()> {
        self.release_after(claim, 0, ReleaseCause::Interrupted, now)
            .await
    }

    /// Releases a job that was leased in advance and not started, if `claim.holder` still holds the lease. False if another
    /// worker holds it, or it is lost. The attempt does not count.
    #[boxed_future]
    pub async fn release_unstarted(&self, claim: &JobClaim, now: Timestamp) -> Result<bool> {
        let actor = Actor::Worker(claim.holder.clone());
        self.write(actor, now, async |tx| {
            let ClaimState::Leased { kind } = queue::claim_state(tx, claim).await? else {
                return Ok(false);
            };
            if !queue::is_holder(tx, claim).await? {
                return Ok(false);
            }
            requeue_leased(tx, claim, &kind, 0, ReleaseCause::Interrupted).await?;
            Ok(true)
        })
        .await
    }

    /// Releases a job that met a full disk; it is run again after a pause. The attempt does not count as a
    /// failure. For a lost lease nothing is recorded. [`health`](Self::health) reports jobs that repeatedly
    /// run out of space on a disk with enough free space.
    #[boxed_future]
    pub async fn release_disk_full(&self, claim: &JobClaim, now: Timestamp) -> Result<()> {
        let cause = if self.free_space.is_short() {
            ReleaseCause::Interrupted
        } else {
            ReleaseCause::OutOfSpace
        };
        self.release_after(claim, FULL_DISK_DELAY_S, cause, now)
            .await
    }

    /// Extends all leases to `lease_s` seconds from now. Their holders may have been unable to renew them, because the
    /// database could not be written.
    #[boxed_future]
    pub async fn renew_all_leases(&self, lease_s: u32, now: Timestamp) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            queue::renew_all_leases(tx, lease_s, now).await
        })
        .await
    }

    async fn release_after(
        &self,
        claim: &JobClaim,
        delay_s: u32,
        cause: ReleaseCause,
        now: Timestamp,
    ) -> Result<()> {
        let actor = Actor::Worker(claim.holder.clone());
        self.write(actor, now, async |tx| {
            match queue::claim_state(tx, claim).await? {
                ClaimState::Leased { kind } => {
                    requeue_leased(tx, claim, &kind, delay_s, cause).await
                }
                ClaimState::AlreadyDone | ClaimState::Lost => Ok(()),
            }
        })
        .await
    }

    /// Releases all jobs leased by `holder` and by every name `holder/…`, none of which is running them. Returns their
    /// number; the attempts do not count.
    #[boxed_future]
    pub async fn release_leases_of(&self, holder: &str, now: Timestamp) -> Result<u64> {
        let actor = Actor::Worker(holder.to_owned());
        self.write(actor, now, async |tx| requeue_leases_of(tx, holder).await)
            .await
    }

    /// Ends the leases of a worker that is known to be dead, and of its slots, before they expire:
    /// `worker` itself and every name `worker/…`. Returns the number of leases. The attempts stay counted.
    #[boxed_future]
    pub async fn end_leases_of(&self, worker: &str, now: Timestamp) -> Result<u64> {
        let actor = Actor::Worker(worker.to_owned());
        self.write(actor, now, async |tx| queue::end_leases(tx, worker).await)
            .await
    }
}
