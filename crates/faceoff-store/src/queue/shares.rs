//! Who is served next: the lane that was served least, in it the smallest batch, and of that the account that was
//! served least. What a lease takes of a
//! slot is charged to both by the database (`slot_time_is_charged`), whatever becomes of the unit.

use crate::{column::Instant, error::Result, write::Tx};

/// Work that waits for work of its own sort only. Slot time is divided equally among the lanes of one
/// urgency in which something waits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane {
    pub(crate) name: &'static str,
    /// The smaller is served first, whatever was served before.
    pub(crate) urgency: u32,
    /// Of two lanes that were served alike, the smaller is served first.
    pub(crate) rank: u32,
}

/// In one lane, whoever units are done for; slot time of a lane is divided equally among those that wait.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Account(pub(crate) i64);

/// The account of `holder` in `lane`, to queue units of. Who comes back after a pause starts beside the
/// least served that waits, or beside the most served if nobody does: neither what it left unused
/// counts for it, nor what it had while nobody else wanted it against it. The same holds for lanes. What is
/// charged of leases that still run is not used yet.
pub(crate) async fn account(tx: &mut Tx, lane: Lane, holder: &str) -> Result<Account> {
    let now = Instant(tx.now);
    sqlx::query!(
        "INSERT INTO lanes (lane, urgency, rank, served_ms)
         VALUES (?1, ?2, ?3, MAX(0, COALESCE(
             (SELECT MIN(l.served_ms -
                         (SELECT COALESCE(SUM(MAX(0, u.claimable_at - ?4)), 0)
                          FROM accounts a CROSS JOIN units u ON u.account_no = a.account_no
                          WHERE a.lane = l.lane AND u.nonce IS NOT NULL
                            AND u.state IN ('queued', 'leased')))
              FROM lanes l WHERE l.urgency = ?2 AND EXISTS (
                 SELECT 1 FROM accounts a CROSS JOIN units u ON u.account_no = a.account_no
                 WHERE a.lane = l.lane AND u.state IN ('queued', 'leased')
                   AND (u.state = 'leased' OR u.claimable_at <= ?4))),
             (SELECT MAX(served_ms) FROM lanes WHERE urgency = ?2),
             0)))
         ON CONFLICT (lane) DO UPDATE SET urgency = excluded.urgency, rank = excluded.rank,
                                          served_ms = MAX(served_ms, excluded.served_ms)",
        lane.name,
        lane.urgency,
        lane.rank,
        now,
    )
    .execute(&mut **tx)
    .await?;
    let account = sqlx::query_scalar!(
        r#"INSERT INTO accounts (lane, holder, served_ms)
           VALUES (?1, ?2, MAX(0, COALESCE(
               (SELECT MIN(a.served_ms -
                           (SELECT COALESCE(SUM(MAX(0, u.claimable_at - ?3)), 0) FROM units u
                            WHERE u.account_no = a.account_no AND u.nonce IS NOT NULL
                              AND u.state IN ('queued', 'leased')))
                FROM accounts a WHERE a.lane = ?1 AND EXISTS (
                   SELECT 1 FROM units u
                   WHERE u.account_no = a.account_no AND u.state IN ('queued', 'leased')
                     AND (u.state = 'leased' OR u.claimable_at <= ?3))),
               (SELECT MAX(served_ms) FROM accounts WHERE lane = ?1),
               0)))
           ON CONFLICT (lane, holder) DO UPDATE SET served_ms = MAX(served_ms, excluded.served_ms)
           RETURNING account_no AS "account_no!: i64""#,
        lane.name,
        holder,
        now,
    )
    .fetch_one(&mut **tx)
    .await?;
    Ok(Account(account))
}
