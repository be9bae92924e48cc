//! When a day's seed, datasets and logs leave the server: when nothing of the day is under way, at once,
//! and by nobody's request.

use crate::{
    error::Result,
    event::{Event, Subject},
    tables::{days, entries, evaluations},
    write::Tx,
};
use faceoff_types::{EvaluationId, StageDay};

/// Releases the day of an evaluation that has just ended, if it was the last: in the same transaction.
pub(crate) async fn if_over(tx: &mut Tx, ended: EvaluationId) -> Result<()> {
    let of = entries::find(tx, ended).await?.of;
    unless_under_way(tx, of).await
}

/// Releases a day none of whose evaluations is under way.
pub(crate) async fn unless_under_way(tx: &mut Tx, of: StageDay) -> Result<()> {
    if evaluations::count_open(tx, Some(of)).await? == 0 {
        let now = tx.now;
        if days::set_released(tx, of, now).await? {
            tx.record(Subject::Day(of), Event::DayReleased);
        }
    }
    Ok(())
}
