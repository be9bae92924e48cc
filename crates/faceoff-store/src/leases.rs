//! What a worker does with a lease: renew it, hand it back, or turn it into a commit.

use crate::{
    Event, Store, StoreError,
    column::Instant,
    queue::{self, Owner},
};
use faceoff_types::{AblationRunId, EvaluationId, ShardId, SubmissionId};
use jiff::{SignedDuration, Timestamp};
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Proof of a lease.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// The unit of work.
    pub unit: Uuid,
    /// Drawn for this lease alone.
    pub nonce: Uuid,
    /// When the lease ended, had it not been renewed.
    pub lease_until: Timestamp,
}

/// What became of a commit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Committed {
    /// It is stored.
    Now,
    /// This very lease has committed before; nothing was changed.
    Before,
    /// The unit is another worker's, or was dropped; nothing was changed.
    LeaseLost,
}

/// The unit behind a claim.
#[derive(Debug)]
pub(crate) struct Unit {
    pub(crate) kind: String,
    pub(crate) submission: SubmissionId,
    pub(crate) evaluation: Option<EvaluationId>,
    shard: Option<ShardId>,
    pub(crate) ablation_run: Option<AblationRunId>,
    failures: u32,
}

impl Unit {
    /// Its evaluation, if it is of this kind.
    pub(crate) fn evaluation_of(&self, kind: &str) -> Result<EvaluationId, StoreError> {
        self.evaluation
            .filter(|_| self.kind == kind)
            .ok_or_else(|| self.other_than(kind))
    }

    /// Its shard.
    pub(crate) fn shard(&self) -> Result<ShardId, StoreError> {
        self.shard.ok_or_else(|| self.other_than("shard"))
    }

    /// Its run of an ablation.
    pub(crate) fn ablation_run(&self) -> Result<AblationRunId, StoreError> {
        self.ablation_run.ok_or_else(|| self.other_than("ablation"))
    }

    pub(crate) fn other_than(&self, kind: &str) -> StoreError {
        StoreError::Conflict(format!(
            "the claim is on a {} unit, not on a {kind}",
            self.kind
        ))
    }

    /// What a page shows of it.
    pub(crate) fn event(&self) -> Event {
        self.evaluation
            .map_or(Event::Submission(self.submission), Event::Evaluation)
    }
}

/// How a claim stands.
pub(crate) enum Hold {
    /// It is the unit's lease. Its time may be over: as long as nobody else took the unit, its
    /// holder's work is as good as ever.
    Held(Unit),
    /// Under this lease the unit was done.
    DoneBefore,
    /// The unit is another's, queued again or dropped.
    Lost,
}

/// How a claim stands, within a transaction.
pub(crate) async fn hold(
    connection: &mut SqliteConnection,
    claim: &Claim,
) -> Result<Hold, StoreError> {
    let (id, nonce) = (Text(claim.unit), Text(claim.nonce));
    let row = sqlx::query!(
        r#"SELECT kind AS "kind!", state AS "state!",
                  submission_id AS "submission!: Text<SubmissionId>",
                  evaluation_id AS "evaluation?: Text<EvaluationId>",
                  shard_id AS "shard?: Text<ShardId>",
                  ablation_run_id AS "ablation_run?: Text<AblationRunId>",
                  failures AS "failures!: u32"
           FROM work_units WHERE id = ? AND nonce = ?"#,
        id,
        nonce,
    )
    .fetch_optional(connection)
    .await?;
    Ok(match row {
        Some(row) if row.state == "leased" => Hold::Held(Unit {
            kind: row.kind,
            submission: row.submission.0,
            evaluation: row.evaluation.map(|id| id.0),
            shard: row.shard.map(|id| id.0),
            ablation_run: row.ablation_run.map(|id| id.0),
            failures: row.failures,
        }),
        Some(_) => Hold::DoneBefore,
        None => Hold::Lost,
    })
}

/// The error of a commit that has no other way to say it.
pub(crate) fn lost() -> StoreError {
    StoreError::Conflict("the lease was lost: the unit is another worker's or was dropped".into())
}

/// Takes a held unit out of the queue.
pub(crate) async fn mark_done(
    connection: &mut SqliteConnection,
    claim: &Claim,
    episodes_done: u32,
) -> Result<(), StoreError> {
    let id = Text(claim.unit);
    sqlx::query!(
        "UPDATE work_units SET state = 'done', episodes_done = ? WHERE id = ?",
        episodes_done,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// An instant some seconds later.
pub(crate) fn after(now: Timestamp, seconds: u32) -> Instant {
    Instant(
        now.saturating_add(SignedDuration::from_secs(seconds.into()))
            .unwrap_or(Timestamp::MAX),
    )
}

/// How long a unit rests after its n-th failure, seconds: a full disk is not freed by trying at once.
const fn backoff_s(failures: u32) -> u32 {
    let doubled = if failures < 6 { 1 << failures } else { 60 };
    if doubled < 60 { doubled } else { 60 }
}

impl Store {
    /// Extends the lease to `lease_s` seconds from now and stores the progress. False: the lease was
    /// lost or the work was cancelled, stop.
    pub async fn heartbeat(
        &self,
        claim: &Claim,
        episodes_done: u32,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<bool, StoreError> {
        let (id, nonce, until) = (Text(claim.unit), Text(claim.nonce), after(now, lease_s));
        let mut tx = self.database.begin().await?;
        let renewed = sqlx::query_scalar!(
            r#"UPDATE work_units SET claimable_at = ?, episodes_done = ?
               WHERE id = ? AND nonce = ? AND state = 'leased'
               RETURNING evaluation_id AS "evaluation?: Text<EvaluationId>""#,
            until,
            episodes_done,
            id,
            nonce,
        )
        .fetch_optional(&mut *tx)
        .await?;
        tx.commit().await?;
        if let Some(Some(evaluation)) = &renewed {
            self.signals.changed(Event::Evaluation(evaluation.0));
        }
        Ok(renewed.is_some())
    }

    /// Our fault: the unit goes back to the queue after a growing pause. After
    /// [`MAX_ATTEMPTS`](crate::MAX_ATTEMPTS) failures the evaluation ends as
    /// [`PlatformFailed`](crate::EvaluationState::PlatformFailed) and the team's turn is given back;
    /// a smoke run ends as [`ValidationError`](crate::SubmissionState::ValidationError). Of a lost
    /// lease nothing is recorded.
    pub async fn release_failed(
        &self,
        claim: &Claim,
        reason: &str,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        let Hold::Held(unit) = hold(&mut tx, claim).await? else {
            return Ok(());
        };
        let failures = unit.failures + 1;
        let (id, again_at) = (Text(claim.unit), after(now, backoff_s(failures)));
        sqlx::query!(
            "UPDATE work_units SET state = 'queued', worker = NULL, nonce = NULL, episodes_done = 0,
                                   failures = ?, claimable_at = ?
             WHERE id = ?",
            failures,
            again_at,
            id,
        )
        .execute(&mut *tx)
        .await?;
        if failures >= queue::MAX_ATTEMPTS {
            let owner = Owner::of(unit.evaluation, unit.ablation_run, unit.submission);
            queue::give_up(&mut tx, claim.unit, owner, reason, now).await?;
        }
        tx.commit().await?;
        self.signals.changed(unit.event());
        Ok(())
    }

    /// Ends the leases of a worker that is known to be dead, and of its slots, so that nobody waits
    /// for them to run out: `worker` itself and every name `worker/…`. Returns how many. The attempts
    /// stay counted.
    pub async fn end_leases_of(&self, worker: &str, now: Timestamp) -> Result<u64, StoreError> {
        let now = Instant(now);
        let mut tx = self.database.begin().await?;
        let ended = sqlx::query!(
            "UPDATE work_units SET claimable_at = ?1
             WHERE state = 'leased' AND claimable_at > ?1
               AND (worker = ?2 OR substr(worker, 1, length(?2) + 1) = ?2 || '/')",
            now,
            worker,
        )
        .execute(&mut *tx)
        .await?
        .rows_affected();
        tx.commit().await?;
        if ended > 0 {
            self.signals.work_added();
        }
        Ok(ended)
    }

    /// Shutdown: gives the unit back at once; the attempt does not count. Of a lost lease nothing is
    /// recorded.
    pub async fn release(&self, claim: &Claim, now: Timestamp) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        let Hold::Held(unit) = hold(&mut tx, claim).await? else {
            return Ok(());
        };
        let (id, now) = (Text(claim.unit), Instant(now));
        sqlx::query!(
            "UPDATE work_units SET state = 'queued', worker = NULL, nonce = NULL, episodes_done = 0,
                                   attempts = attempts - 1, claimable_at = ?
             WHERE id = ?",
            now,
            id,
        )
        .execute(&mut *tx)
        .await?;
        tx.commit().await?;
        self.signals.work_added();
        self.signals.changed(unit.event());
        Ok(())
    }
}
