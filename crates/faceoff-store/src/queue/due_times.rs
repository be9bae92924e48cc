//! Times at which jobs can be claimed, or their leases expire, when the clock is set.

use crate::{
    column::Instant,
    error::Result,
    queue::lease::{PARKED_UNTIL_MS, seconds_later},
    write::Tx,
};
use jiff::SignedDuration;

/// Moves the times of all open jobs, except of parked ones. The slot time that leases have been charged stays.
pub(crate) async fn shift_due_times(tx: &mut Tx, by: SignedDuration) -> Result<()> {
    let by_ms = i64::try_from(by.as_millis()).unwrap_or_default();
    sqlx::query!(
        "UPDATE jobs SET claimable_at = claimable_at + ?
         WHERE state IN ('queued', 'leased') AND claimable_at < ?",
        by_ms,
        PARKED_UNTIL_MS,
    )
    .execute(&mut **tx)
    .await?;
    tx.job_added();
    Ok(())
}

/// Shortens times that are more than `longest_s` from now, which no lease and no delay is: waiting jobs can be claimed
/// now, and leases expire after `lease_s`. Returns the number of jobs.
pub(crate) async fn shorten_due_times(tx: &mut Tx, longest_s: u32, lease_s: u32) -> Result<u64> {
    let shortened = sqlx::query!(
        "UPDATE jobs SET claimable_at = CASE state WHEN 'leased' THEN ?1 ELSE ?2 END,
                         charged_ms = CASE state WHEN 'leased' THEN MAX(0, charged_ms + ?1 - claimable_at) ELSE charged_ms END
         WHERE state IN ('queued', 'leased') AND claimable_at > ?3 AND claimable_at < ?4",
        Instant(seconds_later(tx.now, lease_s)),
        Instant(tx.now),
        Instant(seconds_later(tx.now, longest_s)),
        PARKED_UNTIL_MS,
    )
    .execute(&mut **tx)
    .await?
    .rows_affected();
    if shortened > 0 {
        tx.job_added();
    }
    Ok(shortened)
}
