//! The cut: a day of a stage starts, with what each team has active.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        enter::{Entrant, Turn, enter},
        release_day,
    },
    reads,
    store::Store,
    tables::{
        days,
        evaluations::Evaluation,
        season,
        stages::{self, Stage, StagePhase},
        submissions,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, StageDay, StageId};
use jiff::{Timestamp, civil::Date};

pub(crate) fn check_open(stage: &Stage, now: Timestamp) -> Result<()> {
    let closed_at = match stage.phase(now) {
        StagePhase::Open => return Ok(()),
        StagePhase::Upcoming => None,
        StagePhase::Closed => stage.closes_at,
    };
    Err(StoreError::StageNotOpen {
        name: stage.name.to_string(),
        opens_at: stage.opens_at,
        closed_at,
    })
}

/// Of which date a cut is.
pub(crate) enum CutOf<'a> {
    Today,
    /// One that has passed without, and why it is made up for.
    Missed {
        date: Date,
        reason: &'a str,
    },
}

/// Adds a day that is to be played with what is active now.
async fn insert(tx: &mut Tx, stage: &Stage, of: CutOf<'_>) -> Result<StageDay> {
    let now = tx.now;
    let today = stage.day(now);
    match of {
        CutOf::Today => {
            days::insert(tx, today, stage.deadline(today.date, now), now).await?;
            Ok(today)
        }
        CutOf::Missed { date, reason } => {
            let first = stage.zone.date(stage.opens_at);
            if date >= today.date {
                return Err(StoreError::Conflict(format!(
                    "day: {date} has not passed in the stage's zone, where it is {} now; only a day that was missed \
                     is made up for",
                    today.date
                )));
            }
            if date < first {
                return Err(StoreError::Conflict(format!(
                    "day: {date} is not of the stage, whose first is {first}"
                )));
            }
            let of = StageDay { date, ..today };
            days::insert_missed(tx, of, stage.deadline(date, now), reason, now).await?;
            tx.record(
                Subject::Day(of),
                Event::MissedDayStarted {
                    reason: reason.to_owned(),
                },
            );
            Ok(of)
        }
    }
}

async fn cut(tx: &mut Tx, stage: StageId, of: CutOf<'_>) -> Result<(StageDay, Vec<Evaluation>)> {
    season::check_open(tx).await?;
    let stage = stages::find(tx, stage).await?;
    check_open(&stage, tx.now)?;
    begin(tx, &stage, of).await
}

/// A stage's cut, whether it is open or not.
pub(crate) async fn begin(
    tx: &mut Tx,
    stage: &Stage,
    of: CutOf<'_>,
) -> Result<(StageDay, Vec<Evaluation>)> {
    stage.plan().check()?;
    let of = insert(tx, stage, of).await?;
    let turn = Turn {
        of,
        revision: stage.rules.number,
        seed: stage.seed_label(of.date),
        ruleset: stage.rules.rules.ruleset,
        plan: stage.plan(),
    };
    let mut started = Vec::new();
    for submission in submissions::active(tx).await? {
        if let Err(why) = stage.check_takes(&submission) {
            let event = Event::SubmissionNotTaken {
                stage: of.stage,
                day: of.date,
                reason: why.to_string(),
            };
            tx.record(Subject::Submission(submission.id), event);
            continue;
        }
        let entrant = Entrant {
            id: EvaluationId::new(),
            submission: submission.id,
            team: submission.team,
            rerun_of: None,
        };
        let id = enter(tx, entrant, &turn, 0).await?;
        started.push(reads::evaluations::find(tx, id).await?);
    }
    let evaluations = u32::try_from(started.len()).unwrap_or(u32::MAX);
    tx.record(Subject::Day(of), Event::DayStarted { evaluations });
    Ok((of, started))
}

fn unless_empty(started: Vec<Evaluation>) -> Result<Vec<Evaluation>> {
    if started.is_empty() {
        return Err(nobody_plays());
    }
    Ok(started)
}

pub(crate) fn nobody_plays() -> StoreError {
    StoreError::Conflict(
        "no team has a valid submission that the stage takes, so nothing was started, and the day still has its cut"
            .into(),
    )
}

impl Store {
    /// The cut of a stage's day at `now`: queues an evaluation of what each team has active that the stage takes, earliest
    /// upload first. [`StoreError::DayHasCut`] if the day has had it, [`StoreError::StageNotOpen`] before and
    /// after the stage, [`StoreError::Conflict`] if no team has anything to play (the day keeps its cut),
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn start_day(
        &self,
        actor: Actor,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            let (_, started) = cut(tx, stage, CutOf::Today).await?;
            unless_empty(started)
        })
        .await
    }

    /// The cut of a day that was missed, on a date of the stage that has passed: as [`start_day`](Self::start_day),
    /// with what is active at `now`. [`StoreError::DayHasCut`] if the day has had its own, [`StoreError::Conflict`] if
    /// the date has not passed or is none of the stage's.
    #[boxed]
    pub async fn start_missed_day(
        &self,
        actor: Actor,
        of: StageDay,
        reason: &str,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        let date = of.date;
        self.write(actor, now, async |tx| {
            let (_, started) = cut(tx, of.stage, CutOf::Missed { date, reason }).await?;
            unless_empty(started)
        })
        .await
    }

    /// The cut of a stage's day at `now` by the schedule, whoever asks and however often: also of a day that
    /// nobody has anything to play on. `None` if the day has had its cut, or stage or season are not open.
    #[boxed]
    pub async fn start_scheduled_day(
        &self,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>> {
        let started = self.write(Actor::Schedule, now, async |tx| {
            let (of, started) = cut(tx, stage, CutOf::Today).await?;
            release_day::unless_under_way(tx, of).await?;
            Ok(started)
        });
        match started.await {
            Ok(started) => Ok(Some(started)),
            Err(
                StoreError::DayHasCut { .. }
                | StoreError::StageNotOpen { .. }
                | StoreError::SeasonClosed { .. },
            ) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
