//! The cutoff: the moment at which an evaluation day of a stage starts, with each team's active submission.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        new_evaluation::{DaySetup, NO_DELAY_S, NewEvaluation, queue_evaluation},
        release_day,
    },
    queries,
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

/// The date of the day that a cutoff starts.
pub(crate) enum CutoffDate<'a> {
    Today,
    /// A past date without a cutoff, and the reason for starting its day late.
    Missed {
        date: Date,
        reason: &'a str,
    },
}

/// Adds a day. Its evaluations, with the submissions that are active now, are queued afterwards.
async fn insert_day(tx: &mut Tx, stage: &Stage, cutoff: CutoffDate<'_>) -> Result<StageDay> {
    let now = tx.now;
    let today = stage.day(now);
    match cutoff {
        CutoffDate::Today => {
            days::insert(tx, today, stage.deadline(today.date, now), now).await?;
            Ok(today)
        }
        CutoffDate::Missed { date, reason } => {
            let first = stage.zone.date(stage.opens_at);
            if date >= today.date {
                return StoreError::conflict(format!(
                    "day: {date} has not passed in the stage's zone, where it is {} now; only a missed day can be \
                     started late",
                    today.date
                ));
            }
            if date < first {
                return StoreError::conflict(format!(
                    "day: {date} is before the stage's first day, {first}"
                ));
            }
            let stage_day = StageDay { date, ..today };
            days::insert_missed(tx, stage_day, stage.deadline(date, now), reason, now).await?;
            tx.record(
                Subject::Day(stage_day),
                Event::MissedDayStarted {
                    reason: reason.to_owned(),
                },
            );
            Ok(stage_day)
        }
    }
}

async fn start_if_open(
    tx: &mut Tx,
    stage: StageId,
    cutoff: CutoffDate<'_>,
) -> Result<(StageDay, Vec<Evaluation>)> {
    season::check_open(tx).await?;
    let stage = stages::find(tx, stage).await?;
    check_open(&stage, tx.now)?;
    start(tx, &stage, cutoff).await
}

/// Starts a day of a stage, whether the stage is open or not.
pub(crate) async fn start(
    tx: &mut Tx,
    stage: &Stage,
    cutoff: CutoffDate<'_>,
) -> Result<(StageDay, Vec<Evaluation>)> {
    stage.plan().check()?;
    let stage_day = insert_day(tx, stage, cutoff).await?;
    let setup = DaySetup {
        stage_day,
        revision: stage.revision.number,
        seed: stage.seed_label(stage_day.date),
        ruleset: stage.revision.rules.ruleset,
        plan: stage.plan(),
    };
    let mut started = Vec::new();
    for submission in submissions::active(tx).await? {
        if let Err(refusal) = stage.check_accepts(&submission) {
            let event = Event::SubmissionExcluded {
                stage: stage_day.stage,
                day: stage_day.date,
                reason: refusal.to_string(),
            };
            tx.record(Subject::Submission(submission.id), event);
            continue;
        }
        let new = NewEvaluation {
            id: EvaluationId::new(),
            submission: submission.id,
            team: submission.team,
            rerun_of: None,
        };
        let id = queue_evaluation(tx, new, &setup, NO_DELAY_S).await?;
        started.push(queries::evaluations::find(tx, id).await?);
    }
    let evaluations = u32::try_from(started.len()).unwrap_or(u32::MAX);
    tx.record(Subject::Day(stage_day), Event::DayStarted { evaluations });
    Ok((stage_day, started))
}

fn require_evaluations(started: Vec<Evaluation>) -> Result<Vec<Evaluation>> {
    if started.is_empty() {
        return Err(no_valid_submission());
    }
    Ok(started)
}

pub(crate) fn no_valid_submission() -> StoreError {
    StoreError::Conflict(
        "no team has a valid submission that the stage accepts, so the day was not started and its cutoff is still available"
            .into(),
    )
}

impl Store {
    /// Starts a stage's day at `now`: queues an evaluation of each team's active submission that the stage accepts, the
    /// earliest upload first. [`StoreError::CutoffPassed`] if the day had its cutoff, [`StoreError::StageNotOpen`] if the
    /// stage is not open, [`StoreError::Conflict`] if no team has a valid submission (the cutoff remains available),
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn start_day(
        &self,
        actor: Actor,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            let (_, started) = start_if_open(tx, stage, CutoffDate::Today).await?;
            require_evaluations(started)
        })
        .await
    }

    /// Starts a missed day of the stage late: as [`start_day`](Self::start_day), with the submissions that are active at
    /// `now`. [`StoreError::CutoffPassed`] if the day had its cutoff, [`StoreError::Conflict`] if the date has not passed
    /// or is before the stage.
    #[boxed_future]
    pub async fn start_missed_day(
        &self,
        actor: Actor,
        stage_day: StageDay,
        reason: &str,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        let date = stage_day.date;
        self.write(actor, now, async |tx| {
            let (_, started) =
                start_if_open(tx, stage_day.stage, CutoffDate::Missed { date, reason }).await?;
            require_evaluations(started)
        })
        .await
    }

    /// Starts a stage's day at `now` on behalf of the schedule, even if no team has a valid submission. Safe to call
    /// repeatedly. `None` if the day had its cutoff, or the stage or season is not open.
    #[boxed_future]
    pub async fn start_scheduled_day(
        &self,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>> {
        let started = self.write(Actor::Schedule, now, async |tx| {
            let (stage_day, started) = start_if_open(tx, stage, CutoffDate::Today).await?;
            release_day::release_unless_open(tx, stage_day).await?;
            Ok(started)
        });
        match started.await {
            Ok(started) => Ok(Some(started)),
            Err(
                StoreError::CutoffPassed { .. }
                | StoreError::StageNotOpen { .. }
                | StoreError::SeasonClosed { .. },
            ) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
