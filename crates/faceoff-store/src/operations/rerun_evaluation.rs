//! Reruns of an evaluation: the same submission on the same day's episodes. They are automatic after
//! platform faults, otherwise on an organiser's request.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::Actor,
    operations::new_evaluation::{DaySetup, NewEvaluation, queue_evaluation},
    queries,
    store::Store,
    tables::{
        days,
        evaluation_specs::{self, EvaluationSpec},
        evaluations::{self, Evaluation, EvaluationState},
        runs, season, sign_offs, teams,
    },
    write::Tx,
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;

/// Pauses before the first and the second automatic rerun after platform faults, seconds. There is no
/// third rerun, so a day ends even if the fault persists.
pub const RERUN_PAUSES_S: [u32; 2] = [60, 600];

async fn queue_rerun(tx: &mut Tx, spec: EvaluationSpec, delay_s: u32) -> Result<EvaluationId> {
    let run = runs::find(tx, spec.run).await?;
    let new = NewEvaluation {
        id: EvaluationId::new(),
        submission: spec.submission,
        team: spec.team,
        rerun_of: Some(spec.id),
    };
    let setup = DaySetup {
        stage_day: spec.stage_day,
        revision: spec.revision,
        seed: run.seed,
        ruleset: run.ruleset,
        plan: run.plan,
    };
    let id = queue_evaluation(tx, new, &setup, delay_s).await?;
    evaluation_specs::copy_extra(tx, id, spec.id).await?;
    Ok(id)
}

/// Queues a rerun of an evaluation that has just ended by a platform fault. Does nothing if its day is released or
/// past its deadline, or after the last automatic rerun.
pub(crate) async fn rerun_after_platform_fault(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let spec = evaluation_specs::find(tx, id).await?;
    let day = days::find(tx, spec.stage_day).await?;
    if day.released_at.is_some() || day.deadline_at.is_some_and(|at| at <= tx.now) {
        return Ok(());
    }
    let failures = evaluations::count_platform_failed(tx, spec.team, spec.stage_day).await?;
    if let Some(delay_s) = RERUN_PAUSES_S.get(failures.saturating_sub(1)) {
        queue_rerun(tx, spec, *delay_s).await?;
    }
    Ok(())
}

impl Store {
    /// Queues a rerun: the same submission on the same episodes, whether the day is released or not. The evaluation must
    /// have been cancelled, voided, not run in time, or ended by a platform fault. [`StoreError::Conflict`] if it ended
    /// otherwise, the team has another counting evaluation of the day, or the stage is signed off.
    /// [`StoreError::Disqualified`] if the team is disqualified; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn rerun_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let evaluation = queries::evaluations::find(tx, id).await?;
            let ended_without_result = matches!(
                evaluation.state,
                EvaluationState::PlatformFailed { .. }
                    | EvaluationState::Cancelled { .. }
                    | EvaluationState::DeadlineMissed { .. }
            );
            if !ended_without_result && evaluation.voided.is_none() {
                return StoreError::conflict(
                    "only an evaluation that was cancelled or voided, was not run in time, or failed because of a \
                     platform fault can be rerun",
                );
            }
            let spec = evaluation_specs::find(tx, id).await?;
            sign_offs::check_not_signed_off(tx, spec.stage_day.stage).await?;
            teams::check_may_compete(tx, spec.team).await?;
            let id = queue_rerun(tx, spec, 0).await?;
            queries::evaluations::find(tx, id).await
        })
        .await
    }
}
