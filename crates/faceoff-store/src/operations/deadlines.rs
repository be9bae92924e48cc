//! Until when a day may be played. What is left at its deadline is ended, so that the day is released: by our
//! capacity, which costs nobody a turn.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::ends,
    store::Store,
    tables::{
        days,
        evaluations::Failure,
        stages::{self, Stage},
        standings,
    },
    write::Tx,
};
use faceoff_types::StageDay;
use jiff::Timestamp;

/// Gives the days of a stage that are under way the deadlines that its settings say now. A deadline that would
/// have passed is refused, or, `or_stay`, stays where it was.
pub(crate) async fn follow(tx: &mut Tx, stage: &Stage, or_stay: bool) -> Result<()> {
    for day in days::unreleased(tx, stage.id).await? {
        let deadline_at = stage.deadline(day.of.date, day.cut_at);
        if deadline_at == day.deadline_at {
            continue;
        }
        match deadline_at {
            Some(at) if at <= tx.now && or_stay => continue,
            Some(at) if at <= tx.now => {
                return Err(StoreError::Conflict(format!(
                    "the deadline of {}, which is under way, would have been at {at}: give it more time, or \
                     cancel what is left of it first",
                    day.of.date
                )));
            }
            _ => days::set_deadline(tx, day.of, deadline_at).await?,
        }
    }
    Ok(())
}

/// Ends what is left of an overdue day but what only waits for its score; how many.
async fn end(tx: &mut Tx, of: StageDay) -> Result<u32> {
    let zone = stages::find(tx, of.stage).await?.zone;
    let deadline_at = days::find(tx, of).await?.deadline_at.unwrap_or(tx.now);
    let there = deadline_at.to_zoned(zone.time_zone());
    let reason = format!(
        "the deadline of its day came, {}, before all of it was played: for want of our capacity, by no fault of the \
         agent's",
        there.strftime("%Y-%m-%d at %H:%M:%S %Z")
    );
    let left = standings::unplayed_of_day(tx, of).await?;
    let not_played = u32::try_from(left.len()).unwrap_or(u32::MAX);
    tx.record(Subject::Day(of), Event::DayOverdue { not_played });
    for (evaluation, run) in left {
        ends::fail_evaluation(tx, evaluation, run, Failure::NotPlayed(&reason)).await?;
    }
    Ok(not_played)
}

impl Store {
    /// Ends what is left of days that are past their deadline, and releases those days, except that what is
    /// played to its end is scored first. The days that had something left, each with how many evaluations. Whoever
    /// calls it, and however often.
    #[boxed]
    pub async fn end_overdue_days(&self, now: Timestamp) -> Result<Vec<(StageDay, u32)>> {
        let overdue = days::overdue(&mut *self.database.read.acquire().await?, now).await?;
        if overdue.is_empty() {
            return Ok(Vec::new());
        }
        self.write(Actor::Schedule, now, async |tx| {
            let mut ended = Vec::new();
            for of in days::overdue(tx, now).await? {
                ended.push((of, end(tx, of).await?));
            }
            Ok(ended)
        })
        .await
    }
}
