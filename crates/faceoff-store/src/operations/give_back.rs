use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        drafts,
        ends::{self, RunEnd},
        purpose::{self, Purpose},
        runs,
        tournament::play,
    },
    queue::{self, Claim, Hold},
    store::Store,
    tables::{
        evaluations::{self, Failure},
        game_attempts::AttemptOutcome,
        submissions,
    },
    write::Tx,
};
use jiff::Timestamp;
use sqlx::SqliteConnection;
use uuid::Uuid;

/// Failures of ours after which a unit of work is given up.
pub const MAX_ATTEMPTS: u32 = 5;

/// How long a unit that met a full disk rests, seconds: so that one that needs more than there is does not
/// take every slot's time.
const FULL_DISK_REST_S: u32 = 10;

/// What a unit's events are about.
pub(crate) async fn subject(
    connection: &mut SqliteConnection,
    purpose: &Purpose,
) -> Result<Subject> {
    Ok(match purpose {
        Purpose::Smoke(id) => Subject::Submission(*id),
        Purpose::Game(id) => Subject::Game(*id),
        Purpose::Shard { run, .. } => runs::owner(connection, *run).await?.subject(),
        Purpose::Finalise(id) => Subject::Evaluation(*id),
        Purpose::FinaliseDraft { proposal, .. } => Subject::Proposal(*proposal),
    })
}

/// Ends what a unit is for by our fault.
pub(crate) async fn give_up(tx: &mut Tx, unit: Uuid, label: &str, reason: &str) -> Result<()> {
    queue::drop_units(tx, &[unit]).await?;
    match purpose::of_unit(tx, unit, label).await {
        Ok(Purpose::Smoke(id)) => {
            submissions::set_validation_error(tx, id, reason).await?;
            let reason = reason.to_owned();
            tx.record(
                Subject::Submission(id),
                Event::SubmissionNotValidated { reason },
            );
            Ok(())
        }
        Ok(Purpose::Game(id)) => play::give_up(tx, id, reason).await,
        Ok(Purpose::Shard { run, .. }) => {
            let owner = runs::owner(tx, run).await?;
            ends::run_ended(tx, run, owner, RunEnd::PlatformFailed(reason)).await
        }
        Ok(Purpose::Finalise(id)) => {
            let run = evaluations::run_of(tx, id).await?;
            ends::fail_evaluation(tx, id, run, Failure::Platform(reason)).await
        }
        Ok(Purpose::FinaliseDraft { id, run, proposal }) => {
            drafts::fail(tx, id, run, proposal, Failure::Platform(reason)).await
        }
        // It is for nothing that could end.
        Err(StoreError::Damaged(_)) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Puts a held unit back into the queue; the attempt does not count.
async fn give_back(
    tx: &mut Tx,
    claim: &Claim,
    kind: &str,
    rest_s: u32,
    without_room: bool,
) -> Result<()> {
    queue::release(tx, claim, rest_s, without_room).await?;
    let purpose = purpose::of_unit(tx, claim.unit, kind).await?;
    if let Purpose::Game(id) = purpose {
        play::give_back(tx, id, AttemptOutcome::GivenBack, None).await?;
    }
    let subject = subject(tx, &purpose).await?;
    tx.advanced(subject);
    Ok(())
}

/// Puts all that `holder` and those below it have back into the queue; the attempts do not count. What comes of them yet is of a lost lease.
pub(crate) async fn give_back_all(tx: &mut Tx, holder: &str) -> Result<u64> {
    let leases = queue::leases_of(tx, holder).await?;
    for (claim, kind) in &leases {
        give_back(tx, claim, kind, 0, false).await?;
    }
    Ok(u64::try_from(leases.len()).unwrap_or(u64::MAX))
}

impl Store {
    /// Our fault: the unit goes back to the queue after a growing pause. After [`MAX_ATTEMPTS`]
    /// failures the evaluation ends as
    /// [`PlatformFailed`](crate::EvaluationState::PlatformFailed) and is played again, for some times
    /// ([`RERUN_PAUSES_S`](crate::RERUN_PAUSES_S)); a smoke run ends as
    /// [`ValidationError`](crate::SubmissionState::ValidationError), an ablation without a result. Of a lost lease nothing is recorded.
    #[boxed]
    pub async fn release_failed(&self, claim: &Claim, reason: &str, now: Timestamp) -> Result<()> {
        let actor = Actor::Worker(claim.worker.clone());
        self.write(actor, now, async |tx| {
            let Hold::Held { kind } = queue::hold(tx, claim).await? else {
                return Ok(());
            };
            let purpose = purpose::of_unit(tx, claim.unit, &kind).await?;
            let failures = queue::requeue_failed(tx, claim, now).await?;
            let event = Event::UnitGivenBack {
                unit: claim.unit,
                failures,
                reason: reason.to_owned(),
            };
            let subject = subject(tx, &purpose).await?;
            tx.record(subject, event);
            if let Purpose::Game(id) = purpose {
                play::give_back(tx, id, AttemptOutcome::Broken, Some(reason)).await?;
            }
            if failures >= MAX_ATTEMPTS {
                give_up(tx, claim.unit, &kind, reason).await?;
            }
            Ok(())
        })
        .await
    }

    /// Shutdown: gives the unit back at once; the attempt does not count. Of a lost lease nothing is
    /// recorded.
    #[boxed]
    pub async fn release(&self, claim: &Claim, now: Timestamp) -> Result<()> {
        self.release_resting(claim, 0, false, now).await
    }

    /// Gives a unit back that was given out and that nobody has begun: it is still `claim.worker`'s. False if it is another's, or
    /// nobody's any more; the attempt does not count.
    #[boxed]
    pub async fn take_back(&self, claim: &Claim, now: Timestamp) -> Result<bool> {
        let actor = Actor::Worker(claim.worker.clone());
        self.write(actor, now, async |tx| {
            let Hold::Held { kind } = queue::hold(tx, claim).await? else {
                return Ok(false);
            };
            if !queue::is_holder(tx, claim).await? {
                return Ok(false);
            }
            give_back(tx, claim, &kind, 0, false).await?;
            Ok(true)
        })
        .await
    }

    /// A full disk: the unit goes back to the queue to rest for a while. That is nobody's failure: the
    /// attempt does not count. Of a lost lease nothing is recorded. What finds no room again and again on a
    /// disk that is not short of it is told by [`health`](Self::health).
    #[boxed]
    pub async fn release_full(&self, claim: &Claim, now: Timestamp) -> Result<()> {
        let without_room = !self.room.is_short();
        self.release_resting(claim, FULL_DISK_REST_S, without_room, now)
            .await
    }

    /// Gives all leases `lease_s` seconds from now on: they may have run out only because nothing could
    /// be written.
    #[boxed]
    pub async fn renew_all_leases(&self, lease_s: u32, now: Timestamp) -> Result<()> {
        self.write(Actor::Server, now, async |tx| {
            queue::renew_all(tx, lease_s, now).await
        })
        .await
    }

    async fn release_resting(
        &self,
        claim: &Claim,
        rest_s: u32,
        without_room: bool,
        now: Timestamp,
    ) -> Result<()> {
        let actor = Actor::Worker(claim.worker.clone());
        self.write(actor, now, async |tx| {
            match queue::hold(tx, claim).await? {
                Hold::Held { kind } => give_back(tx, claim, &kind, rest_s, without_room).await,
                Hold::DoneBefore | Hold::Lost => Ok(()),
            }
        })
        .await
    }

    /// Gives all back that `holder` and those below it have, of whom nobody works at it. Returns how many; the attempts do not count.
    #[boxed]
    pub async fn give_back_all_of(&self, holder: &str, now: Timestamp) -> Result<u64> {
        let actor = Actor::Worker(holder.to_owned());
        self.write(actor, now, async |tx| give_back_all(tx, holder).await)
            .await
    }

    /// Ends the leases of a worker that is known to be dead, and of its slots, so that nobody waits
    /// for them to run out: `worker` itself and every name `worker/…`. Returns how many. The attempts
    /// stay counted.
    #[boxed]
    pub async fn end_leases_of(&self, worker: &str, now: Timestamp) -> Result<u64> {
        let actor = Actor::Worker(worker.to_owned());
        self.write(actor, now, async |tx| {
            queue::end_leases_of(tx, worker).await
        })
        .await
    }
}
