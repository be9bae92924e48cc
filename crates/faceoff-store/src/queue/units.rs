use crate::{column::Instant, error::Result, queue::lease::after, write::Tx};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// A unit to be queued.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NewUnit {
    pub(crate) kind: &'static str,
    /// The smaller is claimed first; among equals the one queued first.
    pub(crate) urgency: u32,
    /// How long it rests before it can be claimed, seconds.
    pub(crate) rest_s: u32,
}

/// Queues a unit, claimable after its rest.
pub(crate) async fn insert(tx: &mut Tx, unit: NewUnit) -> Result<Uuid> {
    let id = Uuid::now_v7();
    let (id_text, from) = (Text(id), Instant(after(tx.now, unit.rest_s)));
    sqlx::query!(
        "INSERT INTO units (id, kind, urgency, state, claimable_at) VALUES (?, ?, ?, 'queued', ?)",
        id_text,
        unit.kind,
        unit.urgency,
        from,
    )
    .execute(&mut **tx)
    .await?;
    tx.work_added();
    Ok(id)
}

/// A unit just claimed.
pub(crate) struct Leased {
    pub(crate) id: Text<Uuid>,
    pub(crate) kind: String,
    /// This lease counted.
    pub(crate) attempts: u32,
}

/// Claims the unit whose turn it is, one whose lease is over included, in one statement.
pub(crate) async fn claim_next(
    connection: &mut SqliteConnection,
    worker: &str,
    nonce: Uuid,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<Leased>> {
    let (nonce, until, now) = (Text(nonce), Instant(after(now, lease_s)), Instant(now));
    Ok(sqlx::query_as!(
        Leased,
        r#"UPDATE units
           SET state = 'leased', worker = ?, nonce = ?, claimable_at = ?, attempts = attempts + 1,
               progress = 0
           WHERE queue_no = (SELECT queue_no FROM units
                             WHERE state IN ('queued', 'leased') AND claimable_at <= ?
                             ORDER BY urgency, queue_no LIMIT 1)
           RETURNING id AS "id!: Text<Uuid>", kind AS "kind!", attempts AS "attempts!: u32""#,
        worker,
        nonce,
        until,
        now,
    )
    .fetch_optional(connection)
    .await?)
}

/// Takes units that are not done out of the queue; their workers lose the lease.
pub(crate) async fn drop_units(connection: &mut SqliteConnection, units: &[Uuid]) -> Result<()> {
    for unit in units {
        let unit = Text(*unit);
        sqlx::query!(
            "UPDATE units SET state = 'dropped', nonce = NULL
             WHERE id = ? AND state IN ('queued', 'leased')",
            unit,
        )
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}

/// Ends the leases of `worker` and of every name `worker/…`; how many. The attempts stay counted.
pub(crate) async fn end_leases_of(tx: &mut Tx, worker: &str) -> Result<u64> {
    let now = Instant(tx.now);
    let ended = sqlx::query!(
        "UPDATE units SET claimable_at = ?1
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

/// How the queue stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    /// Units under a lease that runs.
    pub(crate) running: u32,
    /// Units that could be claimed now.
    pub(crate) waiting: u32,
    /// Since when the first of them.
    pub(crate) waiting_since: Option<Timestamp>,
}

/// How the queue stands now.
pub(crate) async fn standing(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<Standing> {
    let now = Instant(now);
    let row = sqlx::query!(
        r#"SELECT COUNT(*) FILTER (WHERE state = 'leased' AND claimable_at > ?1) AS "running!: u32",
                  COUNT(*) FILTER (WHERE claimable_at <= ?1) AS "waiting!: u32",
                  MIN(claimable_at) FILTER (WHERE claimable_at <= ?1) AS "since?: Instant"
           FROM units WHERE state IN ('queued', 'leased')"#,
        now,
    )
    .fetch_one(connection)
    .await?;
    Ok(Standing {
        running: row.running,
        waiting: row.waiting,
        waiting_since: row.since.map(|since| since.0),
    })
}
