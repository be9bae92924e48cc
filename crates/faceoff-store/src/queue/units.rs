use crate::{
    column::Instant,
    error::Result,
    queue::{
        lease::after,
        shares::{Account, Lane},
    },
    write::Tx,
};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// A unit to be queued.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NewUnit {
    pub(crate) kind: &'static str,
    pub(crate) lane: Lane,
    /// Of a lane, units of a smaller batch are claimed first, whoever they are of.
    pub(crate) batch: i64,
    /// How long it rests before it can be claimed, seconds.
    pub(crate) rest_s: u32,
}

/// Queues a unit, claimable after its rest. The account is one of its lane; within it units of a batch are
/// claimed in the order in which they were queued.
pub(crate) async fn insert(tx: &mut Tx, unit: NewUnit, account: Account) -> Result<Uuid> {
    let id = Uuid::now_v7();
    let (id_text, from) = (Text(id), Instant(after(tx.now, unit.rest_s)));
    sqlx::query!(
        "INSERT INTO units (id, kind, account_no, batch, state, claimable_at) VALUES (?, ?, ?, ?, 'queued', ?)",
        id_text,
        unit.kind,
        account.0,
        unit.batch,
        from,
    )
    .execute(&mut **tx)
    .await?;
    tx.work_added();
    Ok(id)
}

/// What waits can be claimed again.
pub(crate) const fn goes_on(tx: &mut Tx) {
    tx.work_added();
}

/// A unit just claimed.
pub(crate) struct Leased {
    pub(crate) id: Text<Uuid>,
    pub(crate) kind: String,
    pub(crate) attempts: u32,
}

/// Claims the unit whose turn it is among those that wait in `lanes` (a JSON array of their names), one whose lease is over
/// included, in one statement. The whole lease is
/// charged at once, so that who holds one slot is no longer the least served when the next is free.
pub(crate) async fn claim_next(
    connection: &mut SqliteConnection,
    worker: &str,
    nonce: Uuid,
    lanes: &str,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<Leased>> {
    let (nonce, until, now) = (Text(nonce), Instant(after(now, lease_s)), Instant(now));
    let lease_ms = milliseconds(lease_s);
    Ok(sqlx::query_as!(
        Leased,
        r#"UPDATE units
           SET state = 'leased', worker = ?1, nonce = ?2, claimable_at = ?3, attempts = attempts + 1,
               progress = 0, charged_ms = ?4
           WHERE queue_no = (
               SELECT f.queue_no
               FROM accounts a JOIN lanes l ON l.lane = a.lane
               JOIN units f ON f.queue_no =
                   (SELECT u.queue_no FROM units u
                    WHERE u.account_no = a.account_no AND u.state IN ('queued', 'leased')
                      AND u.claimable_at <= ?5
                    ORDER BY u.batch, u.queue_no LIMIT 1)
               WHERE l.lane IN (SELECT value FROM json_each(?6))
               ORDER BY l.urgency, l.served_ms, l.rank, f.batch, a.served_ms, f.queue_no LIMIT 1)
           RETURNING id AS "id!: Text<Uuid>", kind AS "kind!", attempts AS "attempts!: u32""#,
        worker,
        nonce,
        until,
        lease_ms,
        now,
        lanes,
    )
    .fetch_optional(connection)
    .await?)
}

/// Takes units that are not done out of the queue; their workers lose the lease.
pub(crate) async fn drop_units(tx: &mut Tx, units: &[Uuid]) -> Result<()> {
    let now = Instant(tx.now);
    for unit in units {
        let unit = Text(*unit);
        sqlx::query!(
            "UPDATE units SET state = 'dropped', nonce = NULL,
                              charged_ms = CASE state WHEN 'leased'
                                           THEN MAX(0, charged_ms + ?2 - claimable_at) ELSE 0 END
             WHERE id = ?1 AND state IN ('queued', 'leased')",
            unit,
            now,
        )
        .execute(&mut **tx)
        .await?;
    }
    Ok(())
}

/// Ends the leases of `worker` and of every name `worker/…`; how many. The attempts stay counted, the
/// slot time does not: what died was ours.
pub(crate) async fn end_leases_of(tx: &mut Tx, worker: &str) -> Result<u64> {
    let now = Instant(tx.now);
    let ended = sqlx::query!(
        "UPDATE units SET claimable_at = ?1, charged_ms = 0
         WHERE state = 'leased' AND claimable_at > ?1
           AND (worker = ?2 OR substr(worker, 1, length(?2) + 1) = ?2 || '/')",
        now,
        worker,
    )
    .execute(&mut **tx)
    .await?
    .rows_affected();
    if ended > 0 {
        tx.work_added();
    }
    Ok(ended)
}

/// A unit that was done is to be done once more: what came of it is not believed. Its slot time is charged to nobody.
pub(crate) async fn queue_again(tx: &mut Tx, unit: Uuid) -> Result<()> {
    let (unit, now) = (Text(unit), Instant(tx.now));
    sqlx::query!(
        "UPDATE units SET state = 'queued', worker = NULL, nonce = NULL, progress = 0, charged_ms = 0, claimable_at = ?
         WHERE id = ? AND state = 'done'",
        now,
        unit,
    )
    .execute(&mut **tx)
    .await?;
    tx.work_added();
    Ok(())
}

/// How the queue stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    /// Units under a lease that runs.
    pub(crate) running: u32,
    /// Units that could be claimed now.
    pub(crate) waiting: u32,
    /// Since when the first of them.
    pub(crate) waiting_since: Option<Timestamp>,
    /// Open units that found no room [`OFTEN`] where there should be enough.
    pub(crate) without_room: u32,
}

/// What found no room so many times is not the victim of a moment.
const OFTEN: i64 = 3;

/// How the queue stands now.
pub(crate) async fn standing(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<Standing> {
    let now = Instant(now);
    let row = sqlx::query!(
        r#"SELECT COUNT(*) FILTER (WHERE state = 'leased' AND claimable_at > ?1) AS "running!: u32",
                  COUNT(*) FILTER (WHERE claimable_at <= ?1) AS "waiting!: u32",
                  MIN(claimable_at) FILTER (WHERE claimable_at <= ?1) AS "since?: Instant",
                  COUNT(*) FILTER (WHERE without_room >= ?2) AS "without_room!: u32"
           FROM units WHERE state IN ('queued', 'leased')"#,
        now,
        OFTEN,
    )
    .fetch_one(connection)
    .await?;
    Ok(Standing {
        running: row.running,
        waiting: row.waiting,
        waiting_since: row.since.map(|since| since.0),
        without_room: row.without_room,
    })
}

pub(super) fn milliseconds(seconds: u32) -> i64 {
    1000 * i64::from(seconds)
}
