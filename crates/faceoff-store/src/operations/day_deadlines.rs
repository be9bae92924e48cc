//! Deadlines of evaluation days. Evaluations that are unfinished at the deadline are ended, so that the day's results
//! can be released. They count as a lack of server capacity, not as an agent fault.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::run_completion,
    store::Store,
    tables::{
        counting_evaluations, days,
        evaluations::Failure,
        stages::{self, Stage},
    },
    write::Tx,
};
use faceoff_types::StageDay;
use jiff::Timestamp;

/// Updates the deadlines of a stage's open days after a change of its settings. A deadline in the past is refused;
/// with `keeps_if_past` the day keeps its old deadline instead.
pub(crate) async fn update_deadlines(
    tx: &mut Tx,
    stage: &Stage,
    keeps_if_past: bool,
) -> Result<()> {
    for day in days::unreleased(tx, stage.id).await? {
        let deadline_at = stage.deadline(day.stage_day.date, day.cutoff_at);
        if deadline_at == day.deadline_at {
            continue;
        }
        match deadline_at {
            Some(at) if at <= tx.now && keeps_if_past => continue,
            Some(at) if at <= tx.now => {
                return StoreError::conflict(format!(
                    "the deadline of {}, which is under way, would have been at {at}: give it more time, or \
                     cancel its open evaluations first",
                    day.stage_day.date
                ));
            }
            _ => days::set_deadline(tx, day.stage_day, deadline_at).await?,
        }
    }
    Ok(())
}

/// Ends the unfinished evaluations of an overdue day, except those that only wait for scoring. Returns the number
/// of those ended.
async fn end_day(tx: &mut Tx, stage_day: StageDay) -> Result<u32> {
    let zone = stages::find(tx, stage_day.stage).await?.zone;
    let deadline_at = days::find(tx, stage_day)
        .await?
        .deadline_at
        .unwrap_or(tx.now);
    let local_deadline = deadline_at.to_zoned(zone.time_zone());
    let reason = format!(
        "the deadline of its day ({}) passed before all its episodes were run: the server ran out of time, this is no \
         agent fault",
        local_deadline.strftime("%Y-%m-%d at %H:%M:%S %Z")
    );
    let unfinished = counting_evaluations::incomplete_of_day(tx, stage_day).await?;
    let unfinished_count = u32::try_from(unfinished.len()).unwrap_or(u32::MAX);
    tx.record(
        Subject::Day(stage_day),
        Event::DayOverdue {
            not_played: unfinished_count,
        },
    );
    for evaluation in unfinished {
        run_completion::fail_evaluation(tx, evaluation, Failure::DeadlineMissed(&reason)).await?;
    }
    Ok(unfinished_count)
}

impl Store {
    /// Ends the unfinished evaluations of days past their deadline and releases those days. Evaluations with all their
    /// shards committed are scored first. Returns the days that were ended, each with the number of its unfinished
    /// evaluations. Safe to call repeatedly.
    #[boxed_future]
    pub async fn end_overdue_days(&self, now: Timestamp) -> Result<Vec<(StageDay, u32)>> {
        let overdue = days::overdue(&mut *self.database.read.acquire().await?, now).await?;
        if overdue.is_empty() {
            return Ok(Vec::new());
        }
        self.write(Actor::Schedule, now, async |tx| {
            let mut ended = Vec::new();
            for stage_day in days::overdue(tx, now).await? {
                ended.push((stage_day, end_day(tx, stage_day).await?));
            }
            Ok(ended)
        })
        .await
    }
}
