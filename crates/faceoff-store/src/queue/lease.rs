//! What a worker does with a lease: renew it, hand it back, or turn it into a commit.

use crate::{column::Instant, error::Result, write::Tx};
use jiff::{SignedDuration, Timestamp};
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Proof of a lease.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    pub unit: Uuid,
    /// Drawn for this lease alone.
    pub nonce: Uuid,
    /// To whom; the events of what is done under the lease name it.
    pub worker: String,
    /// When the lease ended, had it not been renewed.
    pub lease_until: Timestamp,
}

/// How a claim stands.
pub(crate) enum Hold {
    /// It is the unit's lease. Its time may be over: as long as nobody else took the unit, its
    /// holder's work is as good as ever.
    Held {
        kind: String,
    },
    /// Under this lease the unit was done.
    DoneBefore,
    /// The unit is another's, queued again or dropped.
    Lost,
}

/// How a claim stands, within a transaction.
pub(crate) async fn hold(connection: &mut SqliteConnection, claim: &Claim) -> Result<Hold> {
    let (id, nonce) = (Text(claim.unit), Text(claim.nonce));
    let row = sqlx::query!(
        "SELECT kind, state = 'leased' AS held FROM units WHERE id = ? AND nonce = ?",
        id,
        nonce,
    )
    .fetch_optional(connection)
    .await?;
    Ok(match row {
        Some(row) if row.held == 1 => Hold::Held { kind: row.kind },
        Some(_) => Hold::DoneBefore,
        None => Hold::Lost,
    })
}

/// Extends the lease to `lease_s` seconds from now and stores the progress; the unit's kind, or
/// `None` if the lease is lost. What it is extended by is charged.
pub(crate) async fn renew(
    connection: &mut SqliteConnection,
    claim: &Claim,
    progress: u32,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<String>> {
    let (id, nonce, until) = (
        Text(claim.unit),
        Text(claim.nonce),
        Instant(after(now, lease_s)),
    );
    Ok(sqlx::query_scalar!(
        r#"UPDATE units SET charged_ms = MAX(0, charged_ms + ?1 - claimable_at), claimable_at = ?1,
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

/// Is the unit leased under this nonce?
pub(crate) async fn is_leased(
    connection: &mut SqliteConnection,
    unit: Uuid,
    nonce: Uuid,
) -> Result<bool> {
    let (unit, nonce) = (Text(unit), Text(nonce));
    let held = sqlx::query_scalar!(
        r#"SELECT state = 'leased' AS "held!: bool" FROM units WHERE id = ? AND nonce = ?"#,
        unit,
        nonce,
    )
    .fetch_optional(connection)
    .await?;
    Ok(held.unwrap_or_default())
}

/// Is the lease `claim.worker`'s, and nobody's whom it was handed to?
pub(crate) async fn is_holder(connection: &mut SqliteConnection, claim: &Claim) -> Result<bool> {
    let (id, nonce) = (Text(claim.unit), Text(claim.nonce));
    let found = sqlx::query_scalar!(
        r#"SELECT worker = ? AS "is_holder!: bool" FROM units WHERE id = ? AND nonce = ? AND state = 'leased'"#,
        claim.worker,
        id,
        nonce,
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.unwrap_or_default())
}

/// Whose the unit's lease is, if it is leased under this nonce.
pub(crate) async fn holder_of(
    connection: &mut SqliteConnection,
    unit: Uuid,
    nonce: Uuid,
) -> Result<Option<String>> {
    let (unit, nonce) = (Text(unit), Text(nonce));
    Ok(sqlx::query_scalar!(
        r#"SELECT worker AS "worker!" FROM units WHERE id = ? AND nonce = ? AND state = 'leased'"#,
        unit,
        nonce,
    )
    .fetch_optional(connection)
    .await?)
}

/// All leases of `holder` and of every name `holder/…`, with their units' labels.
pub(crate) async fn leases_of(tx: &mut Tx, holder: &str) -> Result<Vec<(Claim, String)>> {
    let rows = sqlx::query!(
        r#"SELECT id AS "id!: Text<Uuid>", kind, worker AS "worker!", nonce AS "nonce!: Text<Uuid>",
                  claimable_at AS "lease_until: Instant"
           FROM units
           WHERE state IN ('queued', 'leased') AND state = 'leased'
             AND (worker = ?1 OR substr(worker, 1, length(?1) + 1) = ?1 || '/')"#,
        holder,
    )
    .fetch_all(&mut **tx)
    .await?;
    let leases = rows.into_iter().map(|row| {
        let claim = Claim {
            unit: row.id.0,
            nonce: row.nonce.0,
            worker: row.worker,
            lease_until: row.lease_until.0,
        };
        (claim, row.kind)
    });
    Ok(leases.collect())
}

/// Names another as the lease's holder; false if it is neither `claim.worker`'s any more nor the other's already.
pub(crate) async fn hand_over(
    connection: &mut SqliteConnection,
    claim: &Claim,
    to: &str,
) -> Result<bool> {
    let (id, nonce) = (Text(claim.unit), Text(claim.nonce));
    let handed = sqlx::query!(
        "UPDATE units SET worker = ?1
         WHERE id = ?2 AND nonce = ?3 AND worker IN (?4, ?1) AND state = 'leased'",
        to,
        id,
        nonce,
        claim.worker,
    )
    .execute(connection)
    .await?;
    Ok(handed.rows_affected() == 1)
}

/// Gives the leases of `holder`, and of every name `holder/…`, at least `lease_s` seconds from now.
pub(crate) async fn renew_of(tx: &mut Tx, holder: &str, lease_s: u32) -> Result<u64> {
    let until = Instant(after(tx.now, lease_s));
    let renewed = sqlx::query!(
        "UPDATE units SET claimable_at = ?1
         WHERE state IN ('queued', 'leased') AND state = 'leased' AND claimable_at < ?1
           AND (worker = ?2 OR substr(worker, 1, length(?2) + 1) = ?2 || '/')",
        until,
        holder,
    )
    .execute(&mut **tx)
    .await?;
    Ok(renewed.rows_affected())
}

/// Takes a held unit out of the queue. What is left of its lease is given back to its account, and what
/// it took beyond the lease is charged.
pub(crate) async fn mark_done(tx: &mut Tx, claim: &Claim, progress: u32) -> Result<()> {
    let (id, now) = (Text(claim.unit), Instant(tx.now));
    sqlx::query!(
        "UPDATE units SET state = 'done', progress = ?,
                          charged_ms = MAX(0, charged_ms + ? - claimable_at)
         WHERE id = ?",
        progress,
        now,
        id,
    )
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// Counts a failure of a held unit and queues it again, to rest for a while that grows with the
/// failures; how many there were. No worker is woken: there is nothing to claim yet. Slot time that we
/// wasted is charged to nobody.
pub(crate) async fn requeue_failed(
    connection: &mut SqliteConnection,
    claim: &Claim,
    now: Timestamp,
) -> Result<u32> {
    let id = Text(claim.unit);
    let failures = sqlx::query_scalar!(
        r#"UPDATE units SET state = 'queued', worker = NULL, nonce = NULL, progress = 0,
                            charged_ms = 0, failures = failures + 1
           WHERE id = ? RETURNING failures AS "failures!: u32""#,
        id,
    )
    .fetch_one(&mut *connection)
    .await?;
    let again_at = Instant(after(now, backoff_s(failures)));
    sqlx::query!(
        "UPDATE units SET claimable_at = ? WHERE id = ?",
        again_at,
        id
    )
    .execute(connection)
    .await?;
    Ok(failures)
}

/// Gives all leases a new time of `lease_s` seconds, whether it had run out or not.
pub(crate) async fn renew_all(
    connection: &mut SqliteConnection,
    lease_s: u32,
    now: Timestamp,
) -> Result<()> {
    let until = Instant(after(now, lease_s));
    sqlx::query!(
        // both conditions on the state: by the first SQLite sees that the index of open units serves
        "UPDATE units SET claimable_at = ?1
         WHERE state IN ('queued', 'leased') AND state = 'leased' AND claimable_at < ?1",
        until,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Queues a held unit again, claimable after a rest; neither the attempt nor its slot time counts. Whether it
/// found no room where there should be enough does.
pub(crate) async fn release(
    tx: &mut Tx,
    claim: &Claim,
    rest_s: u32,
    without_room: bool,
) -> Result<()> {
    let (id, from) = (Text(claim.unit), Instant(after(tx.now, rest_s)));
    sqlx::query!(
        "UPDATE units SET state = 'queued', worker = NULL, nonce = NULL, progress = 0,
                          charged_ms = 0, attempts = attempts - 1, claimable_at = ?,
                          without_room = without_room + ?
         WHERE id = ?",
        from,
        without_room,
        id,
    )
    .execute(&mut **tx)
    .await?;
    tx.work_added();
    Ok(())
}

/// A unit just claimed is not to be begun: it waits until it is [unparked](unpark), and neither the attempt nor its slot
/// time counts.
pub(crate) async fn park(tx: &mut Tx, unit: Uuid) -> Result<()> {
    let id = Text(unit);
    sqlx::query!(
        "UPDATE units SET state = 'queued', worker = NULL, nonce = NULL, progress = 0, charged_ms = 0,
                          attempts = attempts - 1, claimable_at = ?
         WHERE id = ?",
        PARKED,
        id,
    )
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// A unit can be claimed from now on, if it waits.
pub(crate) async fn unpark(tx: &mut Tx, unit: Uuid) -> Result<()> {
    let (id, now) = (Text(unit), Instant(tx.now));
    sqlx::query!(
        "UPDATE units SET claimable_at = ? WHERE id = ? AND state = 'queued' AND claimable_at = ?",
        now,
        id,
        PARKED,
    )
    .execute(&mut **tx)
    .await?;
    tx.work_added();
    Ok(())
}

/// When what is parked could be claimed: long after everybody.
const PARKED: i64 = 253_402_207_200_000;

/// An instant some seconds later.
pub(crate) fn after(now: Timestamp, seconds: u32) -> Timestamp {
    now.saturating_add(SignedDuration::from_secs(seconds.into()))
        .unwrap_or(Timestamp::MAX)
}

/// How long a unit rests after its n-th failure, seconds: a full disk is not freed by trying at once.
const fn backoff_s(failures: u32) -> u32 {
    let doubled = if failures < 6 { 1 << failures } else { 60 };
    if doubled < 60 { doubled } else { 60 }
}
