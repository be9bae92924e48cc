//! Release of an evaluation day, after which its seed, datasets and logs may be public: automatic, as soon as no
//! evaluation of the day is open.

use crate::{
    error::Result,
    event::{Event, Subject},
    tables::{days, evaluation_specs, evaluations},
    write::Tx,
};
use faceoff_types::{EvaluationId, StageDay};

/// Releases the day of an evaluation that has just ended, if it was the last open one, in the same transaction.
pub(crate) async fn release_if_over(tx: &mut Tx, evaluation: EvaluationId) -> Result<()> {
    let stage_day = evaluation_specs::find(tx, evaluation).await?.stage_day;
    release_unless_open(tx, stage_day).await
}

/// Releases a day unless an evaluation of it is queued or running.
pub(crate) async fn release_unless_open(tx: &mut Tx, stage_day: StageDay) -> Result<()> {
    if evaluations::count_open(tx, Some(stage_day)).await? == 0 {
        let now = tx.now;
        if days::set_released(tx, stage_day, now).await? {
            tx.record(Subject::Day(stage_day), Event::DayReleased);
        }
    }
    Ok(())
}
