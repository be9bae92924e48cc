//! Fair shares of the slots (the places in which workers run jobs). The least served lane is next; in this lane the jobs of
//! the smallest batch, and of these the jobs of the least served account. A trigger of the database
//! (`slot_time_is_charged`) charges the slot time of a lease to the lane and the account, however the job ends.

use crate::{column::Instant, error::Result, write::Tx};

/// A lane: one of several queues in parallel, each for one class of jobs (validation runs, shards, games …), like a partition of
/// Slurm. Slot time is divided equally among the lanes of one urgency that have waiting jobs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane {
    pub(crate) name: &'static str,
    /// Lanes with a smaller value are always served first.
    pub(crate) urgency: u32,
    /// Of two equally served lanes, the one with the smaller value is served first.
    pub(crate) tie_breaker: u32,
}

/// The number of an account: the record of the slot time that one owner (a team) has used in one lane, as in the fair-share scheduling of
/// Slurm. It is no user account. Slot time of a lane is divided equally among the accounts with waiting jobs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlotTimeAccount(pub(crate) i64);

/// Opens the account of `owner` in `lane`, to queue jobs. An account that returns after a pause starts with
/// the served time of the least served account that has waiting jobs, or else of the most served one. So unused time is no
/// credit, and time used while no other account waited is no debt. The same holds for lanes. The charged rest of a running
/// lease does not count as used.
pub(crate) async fn open_account(tx: &mut Tx, lane: Lane, owner: &str) -> Result<SlotTimeAccount> {
    let now = Instant(tx.now);
    sqlx::query!(
        "INSERT INTO lanes (lane, urgency, rank, served_ms)
         VALUES (?1, ?2, ?3, MAX(0, COALESCE(
             (SELECT MIN(l.served_ms -
                         (SELECT COALESCE(SUM(MAX(0, j.claimable_at - ?4)), 0)
                          FROM accounts a CROSS JOIN jobs j ON j.account_no = a.account_no
                          WHERE a.lane = l.lane AND j.nonce IS NOT NULL
                            AND j.state IN ('queued', 'leased')))
              FROM lanes l WHERE l.urgency = ?2 AND EXISTS (
                 SELECT 1 FROM accounts a CROSS JOIN jobs j ON j.account_no = a.account_no
                 WHERE a.lane = l.lane AND j.state IN ('queued', 'leased')
                   AND (j.state = 'leased' OR j.claimable_at <= ?4))),
             (SELECT MAX(served_ms) FROM lanes WHERE urgency = ?2),
             0)))
         ON CONFLICT (lane) DO UPDATE SET urgency = excluded.urgency, rank = excluded.rank,
                                          served_ms = MAX(served_ms, excluded.served_ms)",
        lane.name,
        lane.urgency,
        lane.tie_breaker,
        now,
    )
    .execute(&mut **tx)
    .await?;
    let account = sqlx::query_scalar!(
        r#"INSERT INTO accounts (lane, holder, served_ms)
           VALUES (?1, ?2, MAX(0, COALESCE(
               (SELECT MIN(a.served_ms -
                           (SELECT COALESCE(SUM(MAX(0, j.claimable_at - ?3)), 0) FROM jobs j
                            WHERE j.account_no = a.account_no AND j.nonce IS NOT NULL
                              AND j.state IN ('queued', 'leased')))
                FROM accounts a WHERE a.lane = ?1 AND EXISTS (
                   SELECT 1 FROM jobs j
                   WHERE j.account_no = a.account_no AND j.state IN ('queued', 'leased')
                     AND (j.state = 'leased' OR j.claimable_at <= ?3))),
               (SELECT MAX(served_ms) FROM accounts WHERE lane = ?1),
               0)))
           ON CONFLICT (lane, holder) DO UPDATE SET served_ms = MAX(served_ms, excluded.served_ms)
           RETURNING account_no AS "account_no!: i64""#,
        lane.name,
        owner,
        now,
    )
    .fetch_one(&mut **tx)
    .await?;
    Ok(SlotTimeAccount(account))
}
