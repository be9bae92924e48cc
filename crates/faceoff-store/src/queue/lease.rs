//! Leases: the right of a worker to run a job for a time. A worker renews its leases, and releases or completes their jobs.

use crate::{column::Instant, error::Result, write::Tx};
use jiff::{SignedDuration, Timestamp};
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// A claim: the proof that a worker has the lease of a job.
#[derive(Debug, Clone, PartialEq)]
pub struct JobClaim {
    pub job: Uuid,
    /// Unique to this lease.
    pub nonce: Uuid,
    /// The lease holder; events of changes under the lease name it as their actor.
    pub holder: String,
    /// When the lease expires unless it is renewed.
    pub lease_until: Timestamp,
}

/// State of a claim.
pub(crate) enum ClaimState {
    /// The job is leased under this claim. The lease may have expired: until another worker claims the job, its result is
    /// accepted.
    Leased { kind: String },
    /// The job was completed under this claim.
    AlreadyDone,
    /// The job was claimed by another worker, queued again or dropped.
    Lost,
}

/// Reads the state of a claim, within a transaction.
pub(crate) async fn claim_state(
    connection: &mut SqliteConnection,
    claim: &JobClaim,
) -> Result<ClaimState> {
    let row = sqlx::query!(
        "SELECT kind, state = 'leased' AS held FROM jobs WHERE id = ? AND nonce = ?",
        Text(claim.job),
        Text(claim.nonce),
    )
    .fetch_optional(connection)
    .await?;
    Ok(match row {
        Some(row) if row.held == 1 => ClaimState::Leased { kind: row.kind },
        Some(_) => ClaimState::AlreadyDone,
        None => ClaimState::Lost,
    })
}

/// Extends the lease to `lease_s` seconds from now and stores the progress (the number of episodes done). Returns the job's
/// kind, or `None` if the lease is lost. The extension is charged to the job's account.
pub(crate) async fn renew(
    connection: &mut SqliteConnection,
    claim: &JobClaim,
    progress: u32,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<String>> {
    let (id, nonce, until) = (
        Text(claim.job),
        Text(claim.nonce),
        Instant(seconds_later(now, lease_s)),
    );
    Ok(sqlx::query_scalar!(
        r#"UPDATE jobs SET charged_ms = MAX(0, charged_ms + ?1 - claimable_at), claimable_at = ?1,
                            progress = ?2
           WHERE id = ?3 AND nonce = ?4 AND state = 'leased' RETURNING kind AS "kind!""#,
        until,
        progress,
        id,
        nonce,
    )
    .fetch_optional(connection)
    .await?)
}

/// Is the job leased under this nonce?
pub(crate) async fn is_leased(
    connection: &mut SqliteConnection,
    job: Uuid,
    nonce: Uuid,
) -> Result<bool> {
    let leased = sqlx::query_scalar!(
        r#"SELECT state = 'leased' AS "held!: bool" FROM jobs WHERE id = ? AND nonce = ?"#,
        Text(job),
        Text(nonce),
    )
    .fetch_optional(connection)
    .await?;
    Ok(leased.unwrap_or_default())
}

/// Is `claim.holder` still the lease holder, so that the lease was not transferred?
pub(crate) async fn is_holder(connection: &mut SqliteConnection, claim: &JobClaim) -> Result<bool> {
    let is_same_worker = sqlx::query_scalar!(
        r#"SELECT worker = ? AS "is_holder!: bool" FROM jobs WHERE id = ? AND nonce = ? AND state = 'leased'"#,
        claim.holder,
        Text(claim.job),
        Text(claim.nonce),
    )
    .fetch_optional(connection)
    .await?;
    Ok(is_same_worker.unwrap_or_default())
}

/// The lease holder of the job, if it is leased under this nonce.
pub(crate) async fn lease_holder(
    connection: &mut SqliteConnection,
    job: Uuid,
    nonce: Uuid,
) -> Result<Option<String>> {
    Ok(sqlx::query_scalar!(
        r#"SELECT worker AS "worker!" FROM jobs WHERE id = ? AND nonce = ? AND state = 'leased'"#,
        Text(job),
        Text(nonce),
    )
    .fetch_optional(connection)
    .await?)
}

/// All leases of `holder` and of every name `holder/…`, with the kinds of their jobs.
pub(crate) async fn leases(tx: &mut Tx, holder: &str) -> Result<Vec<(JobClaim, String)>> {
    let rows = sqlx::query!(
        r#"SELECT id AS "id!", kind, worker AS "worker!", nonce AS "nonce!", claimable_at AS lease_until
           FROM jobs
           WHERE state IN ('queued', 'leased') AND state = 'leased'
             AND (worker = ?1 OR substr(worker, 1, length(?1) + 1) = ?1 || '/')"#,
        holder,
    )
    .fetch_all(&mut **tx)
    .await?;
    let leases = rows.into_iter().map(|row| {
        let claim = JobClaim {
            job: row.id.0,
            nonce: row.nonce.0,
            holder: row.worker,
            lease_until: row.lease_until.0,
        };
        (claim, row.kind)
    });
    Ok(leases.collect())
}

/// Transfers the lease to another holder. False if neither `claim.holder` nor `new_holder` has it.
pub(crate) async fn transfer(
    connection: &mut SqliteConnection,
    claim: &JobClaim,
    new_holder: &str,
) -> Result<bool> {
    let transferred = sqlx::query!(
        "UPDATE jobs SET worker = ?1
         WHERE id = ?2 AND nonce = ?3 AND worker IN (?4, ?1) AND state = 'leased'",
        new_holder,
        Text(claim.job),
        Text(claim.nonce),
        claim.holder,
    )
    .execute(connection)
    .await?;
    Ok(transferred.rows_affected() == 1)
}

/// Extends the leases of `holder`, and of every name `holder/…`, to at least `lease_s` seconds from now.
pub(crate) async fn renew_leases(tx: &mut Tx, holder: &str, lease_s: u32) -> Result<u64> {
    let renewed = sqlx::query!(
        "UPDATE jobs SET claimable_at = ?1
         WHERE state IN ('queued', 'leased') AND state = 'leased' AND claimable_at < ?1
           AND (worker = ?2 OR substr(worker, 1, length(?2) + 1) = ?2 || '/')",
        Instant(seconds_later(tx.now, lease_s)),
        holder,
    )
    .execute(&mut **tx)
    .await?;
    Ok(renewed.rows_affected())
}

/// Completes a leased job. The unused rest of its lease is credited to its account, and time beyond the
/// lease is charged.
pub(crate) async fn mark_done(tx: &mut Tx, claim: &JobClaim, progress: u32) -> Result<()> {
    sqlx::query!(
        "UPDATE jobs SET state = 'done', progress = ?,
                          charged_ms = MAX(0, charged_ms + ? - claimable_at)
         WHERE id = ?",
        progress,
        Instant(tx.now),
        Text(claim.job),
    )
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// Counts a failure of a leased job and queues it again, with a delay that grows with the failures.
/// Returns the number of failures. No worker is woken, because the job cannot be claimed yet. Slot time lost by a
/// platform fault is not charged.
pub(crate) async fn requeue_failed(
    connection: &mut SqliteConnection,
    claim: &JobClaim,
    now: Timestamp,
) -> Result<u32> {
    let id = Text(claim.job);
    let failures = sqlx::query_scalar!(
        r#"UPDATE jobs SET state = 'queued', worker = NULL, nonce = NULL, progress = 0,
                            charged_ms = 0, failures = failures + 1
           WHERE id = ? RETURNING failures AS "failures!""#,
        id,
    )
    .fetch_one(&mut *connection)
    .await?;
    sqlx::query!(
        "UPDATE jobs SET claimable_at = ? WHERE id = ?",
        Instant(seconds_later(now, backoff_s(failures))),
        id
    )
    .execute(connection)
    .await?;
    Ok(failures)
}

/// Extends all leases to at least `lease_s` seconds from now, expired ones included.
pub(crate) async fn renew_all_leases(
    connection: &mut SqliteConnection,
    lease_s: u32,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        // two conditions on the state: the first one lets SQLite use the index of open jobs
        "UPDATE jobs SET claimable_at = ?1
         WHERE state IN ('queued', 'leased') AND state = 'leased' AND claimable_at < ?1",
        Instant(seconds_later(now, lease_s)),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Why a leased job returns to the queue without having failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReleaseCause {
    /// A cause outside of the job: a shutdown, a ban of its worker, or a disk with less than the required minimum free.
    Interrupted,
    /// The job ran out of disk space although the required minimum was free. Such releases are counted.
    OutOfSpace,
}

/// Queues a leased job again, to be claimed after a delay. Neither the attempt nor its slot time counts.
pub(crate) async fn release(
    tx: &mut Tx,
    claim: &JobClaim,
    delay_s: u32,
    cause: ReleaseCause,
) -> Result<()> {
    let is_out_of_space = cause == ReleaseCause::OutOfSpace;
    sqlx::query!(
        "UPDATE jobs SET state = 'queued', worker = NULL, nonce = NULL, progress = 0,
                          charged_ms = 0, attempts = attempts - 1, claimable_at = ?,
                          without_room = without_room + ?
         WHERE id = ?",
        Instant(seconds_later(tx.now, delay_s)),
        is_out_of_space,
        Text(claim.job),
    )
    .execute(&mut **tx)
    .await?;
    tx.job_added();
    Ok(())
}

/// Parks a job that was just claimed: it cannot be claimed until it is [unparked](unpark). Neither the attempt nor its
/// slot time counts.
pub(crate) async fn park(tx: &mut Tx, job: Uuid) -> Result<()> {
    sqlx::query!(
        "UPDATE jobs SET state = 'queued', worker = NULL, nonce = NULL, progress = 0, charged_ms = 0,
                          attempts = attempts - 1, claimable_at = ?
         WHERE id = ?",
        PARKED_UNTIL_MS,
        Text(job),
    )
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// Makes a parked job claimable.
pub(crate) async fn unpark(tx: &mut Tx, job: Uuid) -> Result<()> {
    sqlx::query!(
        "UPDATE jobs SET claimable_at = ? WHERE id = ? AND state = 'queued' AND claimable_at = ?",
        Instant(tx.now),
        Text(job),
        PARKED_UNTIL_MS,
    )
    .execute(&mut **tx)
    .await?;
    tx.job_added();
    Ok(())
}

/// When parked jobs can be claimed: in the year 9999, in milliseconds since 1970.
pub(super) const PARKED_UNTIL_MS: i64 = 253_402_207_200_000;

/// An instant some seconds later.
pub(crate) fn seconds_later(now: Timestamp, seconds: u32) -> Timestamp {
    now.saturating_add(SignedDuration::from_secs(seconds.into()))
        .unwrap_or(Timestamp::MAX)
}

/// Delay after a number of failures of a job, in seconds: 2, 4, 8 and so on, at most 60. A full disk, for example, is not
/// freed at once.
const fn backoff_s(failures: u32) -> u32 {
    let doubled = if failures < 6 { 1 << failures } else { 60 };
    if doubled < 60 { doubled } else { 60 }
}
