//! The steps after a stage (a part of the season with its own rules) has closed: its final day, if it has one, and the
//! sign-off, after which its results are final.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::start_day::{self, CutoffDate},
    store::Store,
    tables::{
        board_freezes,
        evaluations::Evaluation,
        proposals, season, sign_offs,
        stages::{self, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{CountingResult, StageId};
use jiff::Timestamp;

/// Refuses a step that requires a closed stage; `requirement` is the rule that the error quotes.
fn check_closed(stage: &Stage, now: Timestamp, requirement: &str) -> Result<()> {
    if stage.phase(now) == StagePhase::Closed {
        return Ok(());
    }
    let closing_time = match stage.closes_at {
        Some(at) => format!("it closes on {}", at.strftime("%Y-%m-%d at %H:%M:%S UTC")),
        None => "it has no end yet: give it one".to_owned(),
    };
    StoreError::conflict(format!(
        "the stage {:?} has not closed, and {requirement}; {closing_time}",
        stage.name.as_str()
    ))
}

/// Do the stage's standings need a final day that has not started? A stage without any score needs none.
pub(crate) async fn is_final_day_pending(tx: &mut Tx, stage: &Stage) -> Result<bool> {
    Ok(stage.settings.counting_result == CountingResult::Final
        && stage.sign_off.is_none()
        && sign_offs::final_cutoff(tx, stage.id).await?.is_none()
        && sign_offs::count_scored(tx, stage.id).await? > 0)
}

/// Refuses a stage that cannot be signed off yet.
async fn check_ready_for_sign_off(tx: &mut Tx, stage: &Stage) -> Result<()> {
    sign_offs::check_not_signed_off(tx, stage.id).await?;
    // A season's end ends the stages that had none.
    if season::read(tx).await?.closed_at.is_none() {
        check_closed(stage, tx.now, "only a closed stage can be signed off")?;
    }
    let open_evaluations = sign_offs::count_open(tx, stage.id).await?;
    if open_evaluations > 0 {
        return StoreError::conflict(format!(
            "{open_evaluations} evaluations of the stage {:?} are queued or running: wait until they are over, or \
             cancel them",
            stage.name.as_str()
        ));
    }
    if stage.settings.blind {
        return StoreError::conflict(format!(
            "the stage {:?} is blind, so no team could check its results: set `blind` to false first",
            stage.name.as_str()
        ));
    }
    if let Some(frozen) = board_freezes::find(tx, stage.id).await? {
        return StoreError::conflict(format!(
            "the boards of the stage {:?} are frozen since {}: unfreeze them first",
            stage.name.as_str(),
            frozen.at
        ));
    }
    let undecided_count = proposals::all(tx)
        .await?
        .into_iter()
        .filter(|proposal| proposal.stage == stage.id && proposal.outcome.is_none())
        .count();
    if undecided_count > 0 {
        return StoreError::conflict(format!(
            "{undecided_count} trials or proposed re-evaluations of the stage {:?} are pending: apply or drop them first",
            stage.name.as_str()
        ));
    }
    if is_final_day_pending(tx, stage).await? {
        return StoreError::conflict(format!(
            "the stage {:?} is decided by its final day, which has not been evaluated: start it first",
            stage.name.as_str()
        ));
    }
    Ok(())
}

impl Store {
    /// Checks whether [`Store::sign_off_stage`] would succeed at `now`.
    ///
    /// # Errors
    /// [`StoreError::Conflict`] with the reason why it would not.
    #[boxed_future]
    pub async fn check_can_sign_off(&self, id: StageId, now: Timestamp) -> Result<Stage> {
        // The check writes nothing, but needs one consistent view of several tables.
        self.write(Actor::Server, now, async |tx| {
            let stage = stages::find(tx, id).await?;
            check_ready_for_sign_off(tx, &stage).await?;
            Ok(stage)
        })
        .await
    }

    /// Signs off a stage's results, which are final from then on. [`StoreError::Conflict`] while neither the stage
    /// nor the season has closed, evaluations are open, the stage is blind, or its final day is pending; and if it is
    /// signed off already.
    #[boxed_future]
    pub async fn sign_off_stage(&self, actor: Actor, id: StageId, now: Timestamp) -> Result<Stage> {
        self.write(actor.clone(), now, async |tx| {
            let stage = stages::find(tx, id).await?;
            check_ready_for_sign_off(tx, &stage).await?;
            sign_offs::sign_off(tx, id, &actor, now).await?;
            tx.record(Subject::Stage(id), Event::StageFinalised);
            stages::find(tx, id).await
        })
        .await
    }

    /// Starts the final day of a closed stage whose standings are those of a final evaluation. Each team's active
    /// submission is evaluated. [`StoreError::Conflict`] if the stage has no final day, has had it, has not closed or is
    /// signed off, or if no team has a valid submission (the cutoff remains available). [`StoreError::CutoffPassed`] if
    /// a day of the stage had its cutoff on the same date; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn start_final_day(
        &self,
        actor: Actor,
        id: StageId,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage = stages::find(tx, id).await?;
            sign_offs::check_not_signed_off(tx, id).await?;
            if stage.settings.counting_result != CountingResult::Final {
                return StoreError::conflict(format!(
                    "the standings of the stage {:?} are “{}”, so it has no final day; only one whose standings are \
                     “final” has",
                    stage.name.as_str(),
                    stage.settings.counting_result
                ));
            }
            check_closed(&stage, now, "its final day comes after that")?;
            if let Some(cutoff_at) = sign_offs::final_cutoff(tx, id).await? {
                return StoreError::conflict(format!(
                    "the final day of the stage {:?} had its cutoff at {cutoff_at}; a stage has only one",
                    stage.name.as_str()
                ));
            }
            let (stage_day, started) = start_day::start(tx, &stage, CutoffDate::Today).await?;
            if started.is_empty() {
                return Err(start_day::no_valid_submission());
            }
            sign_offs::set_final_day(tx, stage_day).await?;
            tx.record(Subject::Stage(id), Event::StageFinalStarted { day: stage_day.date });
            Ok(started)
        })
        .await
    }
}
