//! What comes after a stage's close: its final day, where it has one, and the signing off of its result.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::start_day::{self, CutOf},
    store::Store,
    tables::{
        evaluations::Evaluation,
        finalised, freezes, proposals, season,
        stages::{self, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{StageId, Standings};
use jiff::Timestamp;

fn conflict<T>(why: String) -> Result<T> {
    Err(StoreError::Conflict(why))
}

/// Refuses what comes after the close of a stage that has not closed.
fn check_closed(stage: &Stage, now: Timestamp, what: &str) -> Result<()> {
    if stage.phase(now) == StagePhase::Closed {
        return Ok(());
    }
    let closes = match stage.closes_at {
        Some(at) => format!("it closes on {}", at.strftime("%Y-%m-%d at %H:%M:%S UTC")),
        None => "it has no end yet: give it one".to_owned(),
    };
    conflict(format!(
        "the stage {:?} has not closed, and {what}; {closes}",
        stage.name.as_str()
    ))
}

/// Is the stage decided by a final day that has not had its cut? Not one in which nobody has a score.
pub(crate) async fn final_is_owed(tx: &mut Tx, stage: &Stage) -> Result<bool> {
    Ok(stage.settings.standings == Standings::Final
        && stage.finalised.is_none()
        && finalised::final_cut(tx, stage.id).await?.is_none()
        && finalised::count_scored(tx, stage.id).await? > 0)
}

/// Can the stage be signed off?
async fn check_settled(tx: &mut Tx, stage: &Stage) -> Result<()> {
    finalised::check_not(tx, stage.id).await?;
    // A season's end ends the stages that had none.
    if season::read(tx).await?.closed_at.is_none() {
        check_closed(stage, tx.now, "only what is over is signed off")?;
    }
    let under_way = finalised::count_open(tx, stage.id).await?;
    if under_way > 0 {
        return conflict(format!(
            "{under_way} evaluations of the stage {:?} are queued or running: wait until they are over, or \
             cancel them",
            stage.name.as_str()
        ));
    }
    if stage.settings.blind {
        return conflict(format!(
            "the stage {:?} is blind, and nobody could have checked its result: open it first",
            stage.name.as_str()
        ));
    }
    if let Some(frozen) = freezes::find(tx, stage.id).await? {
        return conflict(format!(
            "the boards of the stage {:?} are frozen since {}: unfreeze them first",
            stage.name.as_str(),
            frozen.at
        ));
    }
    let proposals = proposals::all(tx).await?.into_iter();
    let proposals = proposals.filter(|one| one.stage == stage.id && one.settled.is_none());
    let proposals = proposals.count();
    if proposals > 0 {
        return conflict(format!(
            "{proposals} trials or proposals of the stage {:?} are neither applied nor dropped: settle them first",
            stage.name.as_str()
        ));
    }
    if final_is_owed(tx, stage).await? {
        return conflict(format!(
            "the stage {:?} is decided by its final day, and that has not been played: start it first",
            stage.name.as_str()
        ));
    }
    Ok(())
}

impl Store {
    /// Would [`Store::finalise_stage`] be done at `now`?
    ///
    /// # Errors
    /// [`StoreError::Conflict`] says what it waits for.
    #[boxed]
    pub async fn check_stage_settled(&self, id: StageId, now: Timestamp) -> Result<Stage> {
        // It writes nothing, but what it finds belongs together.
        self.write(Actor::Server, now, async |tx| {
            let stage = stages::find(tx, id).await?;
            check_settled(tx, &stage).await?;
            Ok(stage)
        })
        .await
    }

    /// Signs a stage's result off: nothing of the stage changes any more. [`StoreError::Conflict`] while neither it
    /// nor the season has closed, evaluations of it are under way, it is blind, or its final day is owed; and if it is signed off.
    #[boxed]
    pub async fn finalise_stage(&self, actor: Actor, id: StageId, now: Timestamp) -> Result<Stage> {
        self.write(actor.clone(), now, async |tx| {
            let stage = stages::find(tx, id).await?;
            check_settled(tx, &stage).await?;
            finalised::set(tx, id, &actor, now).await?;
            tx.record(Subject::Stage(id), Event::StageFinalised);
            stages::find(tx, id).await
        })
        .await
    }

    /// The one cut of a stage after its close, if its standings are those of a final evaluation: what each team has
    /// active then plays it. [`StoreError::Conflict`] if it has no such day, has had it, has not closed or is signed
    /// off, or no team has anything to play (the day keeps its cut); [`StoreError::DayHasCut`] if a day of the stage
    /// had its cut on the same date; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn start_final_day(
        &self,
        actor: Actor,
        id: StageId,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage = stages::find(tx, id).await?;
            finalised::check_not(tx, id).await?;
            if stage.settings.standings != Standings::Final {
                return conflict(format!(
                    "the standings of the stage {:?} are “{}”, so it has no final day; only one whose standings are \
                     “final” has",
                    stage.name.as_str(),
                    stage.settings.standings
                ));
            }
            check_closed(&stage, now, "its final day comes after that")?;
            if let Some(cut_at) = finalised::final_cut(tx, id).await? {
                return conflict(format!(
                    "the final day of the stage {:?} had its cut at {cut_at}, and there is one",
                    stage.name.as_str()
                ));
            }
            let (of, started) = start_day::begin(tx, &stage, CutOf::Today).await?;
            if started.is_empty() {
                return Err(start_day::nobody_plays());
            }
            finalised::set_final_day(tx, of).await?;
            tx.record(Subject::Stage(id), Event::StageFinalStarted { day: of.date });
            Ok(started)
        })
        .await
    }
}
