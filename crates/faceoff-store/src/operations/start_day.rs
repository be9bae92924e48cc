//! The cut: a day of a stage starts, with what each team has active.

use crate::{
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
use faceoff_types::{StageDay, StageId};
use jiff::Timestamp;

fn check_open(stage: &Stage, now: Timestamp) -> Result<()> {
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

async fn cut(tx: &mut Tx, stage: StageId) -> Result<(StageDay, Vec<Evaluation>)> {
    season::check_open(tx).await?;
    let stage = stages::find(tx, stage).await?;
    check_open(&stage, tx.now)?;
    begin(tx, &stage).await
}

/// A stage's cut, whether it is open or not.
pub(crate) async fn begin(tx: &mut Tx, stage: &Stage) -> Result<(StageDay, Vec<Evaluation>)> {
    let now = tx.now;
    let of = stage.day(now);
    let turn = Turn {
        of,
        revision: stage.rules.number,
        seed: stage.seed_label(of.date),
        ruleset: stage.rules.rules.ruleset,
        plan: stage.plan(),
    };
    turn.plan.check()?;
    days::insert(tx, of, now).await?;
    let mut started = Vec::new();
    for submission in submissions::active(tx).await? {
        let entrant = Entrant {
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

pub(crate) fn nobody_plays() -> StoreError {
    StoreError::Conflict(
        "no team has a valid submission, so nothing was started, and the day still has its cut"
            .into(),
    )
}

impl Store {
    /// The cut of a stage's day at `now`: queues an evaluation of what each team has active, earliest
    /// upload first. [`StoreError::DayHasCut`] if the day has had it, [`StoreError::StageNotOpen`] before and
    /// after the stage, [`StoreError::Conflict`] if no team has anything to play (the day keeps its cut),
    /// [`StoreError::SeasonClosed`] once the season is over.
    pub async fn start_day(
        &self,
        actor: Actor,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            let (_, started) = cut(tx, stage).await?;
            if started.is_empty() {
                return Err(nobody_plays());
            }
            Ok(started)
        })
        .await
    }

    /// The cut of a stage's day at `now` by the schedule, whoever asks and however often: also of a day that
    /// nobody has anything to play on. `None` if the day has had its cut, or stage or season are not open.
    pub async fn start_scheduled_day(
        &self,
        stage: StageId,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>> {
        let started = self.write(Actor::Schedule, now, async |tx| {
            let (of, started) = cut(tx, stage).await?;
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
