//! Jobs in the queue: their insertion, their claim by workers, and their removal.

use crate::{
    column::Instant,
    error::Result,
    queue::{
        lease::seconds_later,
        shares::{Lane, SlotTimeAccount},
    },
    write::Tx,
};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// A job to be queued.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NewJob {
    pub(crate) kind: &'static str,
    pub(crate) lane: Lane,
    /// Within a lane, jobs of a smaller batch are claimed first, regardless of their account.
    pub(crate) batch: i64,
    /// Delay before it can be claimed, in seconds.
    pub(crate) delay_s: u32,
}

/// Queues a job, which can be claimed after its delay. The account must be one of its lane. Within the account, jobs of a
/// batch are claimed in the order in which they were queued.
pub(crate) async fn insert(tx: &mut Tx, job: NewJob, account: SlotTimeAccount) -> Result<Uuid> {
    let id = Uuid::now_v7();
    sqlx::query!(
        "INSERT INTO jobs (id, kind, account_no, batch, state, claimable_at) VALUES (?, ?, ?, ?, 'queued', ?)",
        Text(id),
        job.kind,
        account.0,
        job.batch,
        Instant(seconds_later(tx.now, job.delay_s)),
    )
    .execute(&mut **tx)
    .await?;
    tx.job_added();
    Ok(id)
}

/// Wakes idle workers after a pause: waiting jobs can be claimed again.
pub(crate) const fn wake_workers(tx: &mut Tx) {
    tx.job_added();
}

/// A job that was just claimed.
pub(crate) struct LeasedJob {
    pub(crate) id: Text<Uuid>,
    pub(crate) kind: String,
    pub(crate) attempts: u32,
}

/// Claims the next job of `lanes` (a JSON array of their names) in one statement; jobs with expired leases can be claimed,
/// too. The time of the whole lease is charged to the account at once. So the owner of a running job is no longer the least served account when the
/// next slot becomes free.
pub(crate) async fn claim_next(
    connection: &mut SqliteConnection,
    worker: &str,
    nonce: Uuid,
    lanes: &str,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<LeasedJob>> {
    let (nonce, lease_until, now) = (
        Text(nonce),
        Instant(seconds_later(now, lease_s)),
        Instant(now),
    );
    let lease_ms = milliseconds(lease_s);
    Ok(sqlx::query_as!(
        LeasedJob,
        r#"UPDATE jobs
           SET state = 'leased', worker = ?1, nonce = ?2, claimable_at = ?3, attempts = attempts + 1,
               progress = 0, charged_ms = ?4
           WHERE queue_no = (
               SELECT f.queue_no
               FROM accounts a JOIN lanes l ON l.lane = a.lane
               JOIN jobs f ON f.queue_no =
                   (SELECT j.queue_no FROM jobs j
                    WHERE j.account_no = a.account_no AND j.state IN ('queued', 'leased')
                      AND j.claimable_at <= ?5
                    ORDER BY j.batch, j.queue_no LIMIT 1)
               WHERE l.lane IN (SELECT value FROM json_each(?6))
               ORDER BY l.urgency, l.served_ms, l.rank, f.batch, a.served_ms, f.queue_no LIMIT 1)
           RETURNING id AS "id!", kind AS "kind!", attempts AS "attempts!""#,
        worker,
        nonce,
        lease_until,
        lease_ms,
        now,
        lanes,
    )
    .fetch_optional(connection)
    .await?)
}

/// Removes jobs that are not done from the queue; workers that run them lose the lease.
pub(crate) async fn drop_jobs(tx: &mut Tx, jobs: &[Uuid]) -> Result<()> {
    for job in jobs {
        sqlx::query!(
            "UPDATE jobs SET state = 'dropped', nonce = NULL,
                              charged_ms = CASE state WHEN 'leased'
                                           THEN MAX(0, charged_ms + ?2 - claimable_at) ELSE 0 END
             WHERE id = ?1 AND state IN ('queued', 'leased')",
            Text(*job),
            Instant(tx.now),
        )
        .execute(&mut **tx)
        .await?;
    }
    Ok(())
}

/// Ends the leases of `worker` and of every name `worker/…`, and returns their number. The attempts stay counted. The
/// slot time is not charged, because a process of the platform died.
pub(crate) async fn end_leases(tx: &mut Tx, worker: &str) -> Result<u64> {
    let ended = sqlx::query!(
        "UPDATE jobs SET claimable_at = ?1, charged_ms = 0
         WHERE state = 'leased' AND claimable_at > ?1
           AND (worker = ?2 OR substr(worker, 1, length(?2) + 1) = ?2 || '/')",
        Instant(tx.now),
        worker,
    )
    .execute(&mut **tx)
    .await?
    .rows_affected();
    if ended > 0 {
        tx.job_added();
    }
    Ok(ended)
}

/// Queues a job again that was done, because its result is rejected. Its slot time is not charged.
pub(crate) async fn requeue(tx: &mut Tx, job: Uuid) -> Result<()> {
    sqlx::query!(
        "UPDATE jobs SET state = 'queued', worker = NULL, nonce = NULL, progress = 0, charged_ms = 0, claimable_at = ?
         WHERE id = ? AND state = 'done'",
        Instant(tx.now),
        Text(job),
    )
    .execute(&mut **tx)
    .await?;
    tx.job_added();
    Ok(())
}

/// Current numbers of running and waiting jobs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QueueGauges {
    /// Jobs under a valid lease.
    pub(crate) running: u32,
    /// Jobs that a worker can claim.
    pub(crate) waiting: u32,
    /// Since when a worker can claim the first of them.
    pub(crate) waiting_since: Option<Timestamp>,
    /// Open jobs that ran out of disk space at least [`MIN_OUT_OF_SPACE_COUNT`] times although the required minimum was
    /// free.
    pub(crate) out_of_space: u32,
}

/// From this number of times on, lack of disk space is not a momentary condition.
const MIN_OUT_OF_SPACE_COUNT: i64 = 3;

/// Gauges of the queue at `now`.
pub(crate) async fn gauges(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<QueueGauges> {
    let row = sqlx::query!(
        r#"SELECT COUNT(*) FILTER (WHERE state = 'leased' AND claimable_at > ?1) AS "running!: u32",
                  COUNT(*) FILTER (WHERE claimable_at <= ?1) AS "waiting!: u32",
                  MIN(claimable_at) FILTER (WHERE claimable_at <= ?1) AS "since?: Instant",
                  COUNT(*) FILTER (WHERE without_room >= ?2) AS "without_room!: u32"
           FROM jobs WHERE state IN ('queued', 'leased')"#,
        Instant(now),
        MIN_OUT_OF_SPACE_COUNT,
    )
    .fetch_one(connection)
    .await?;
    Ok(QueueGauges {
        running: row.running,
        waiting: row.waiting,
        waiting_since: row.since.map(|since| since.0),
        out_of_space: row.without_room,
    })
}

pub(super) fn milliseconds(seconds: u32) -> i64 {
    1000 * i64::from(seconds)
}
