//! The cut: a day starts, with what each team has active.

use crate::{
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        enter::{Entrant, enter},
        release_day,
    },
    reads,
    store::Store,
    tables::{days, evaluations::Evaluation, plan::RunPlan, season, submissions},
    write::Tx,
};
use faceoff_types::Ruleset;
use jiff::{Timestamp, civil::Date, tz::TimeZone};

/// The UTC day of an instant.
fn utc_day(now: Timestamp) -> Date {
    now.to_zoned(TimeZone::UTC).date()
}

async fn cut(tx: &mut Tx, plan: &RunPlan) -> Result<Vec<Evaluation>> {
    plan.check()?;
    season::check_open(tx).await?;
    let now = tx.now;
    let day = utc_day(now);
    days::insert(tx, day, now).await?;
    let mut started = Vec::new();
    for submission in submissions::active(tx).await? {
        let entrant = Entrant {
            submission: submission.id,
            team: submission.team,
            ruleset: Ruleset::CURRENT,
            rerun_of: None,
        };
        let id = enter(tx, entrant, day, plan, 0).await?;
        started.push(reads::evaluations::find(tx, id).await?);
    }
    let evaluations = u32::try_from(started.len()).unwrap_or(u32::MAX);
    tx.record(Subject::Day(day), Event::DayStarted { evaluations });
    Ok(started)
}

impl Store {
    /// The cut of `now`'s UTC day: queues an evaluation of what each team has active, earliest upload
    /// first. [`StoreError::DayHasCut`] if the day has had it, [`StoreError::Conflict`] if no team has
    /// anything to play (the day keeps its cut), [`StoreError::SeasonClosed`] once the season is over.
    pub async fn start_day(
        &self,
        actor: Actor,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            let started = cut(tx, plan).await?;
            if started.is_empty() {
                return Err(StoreError::Conflict(
                    "no team has a valid submission, so nothing was started, and the day still has its \
                     cut"
                        .into(),
                ));
            }
            Ok(started)
        })
        .await
    }

    /// The cut of `now`'s UTC day by the schedule, whoever asks and however often: also of a day that
    /// nobody has anything to play on. `None` if the day has had its cut, or the season is closed.
    pub async fn start_scheduled_day(
        &self,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>> {
        let started = self.write(Actor::Schedule, now, async |tx| {
            let started = cut(tx, plan).await?;
            release_day::unless_under_way(tx, utc_day(now)).await?;
            Ok(started)
        });
        match started.await {
            Ok(started) => Ok(Some(started)),
            Err(StoreError::DayHasCut { .. } | StoreError::SeasonClosed { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
