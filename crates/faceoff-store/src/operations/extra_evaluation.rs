//! Extra evaluations: an organiser gives a team one more evaluation of a day. The team had none that counts, or the extra
//! one replaces it.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        new_evaluation::{DaySetup, NO_DELAY_S, NewEvaluation, queue_evaluation},
        organiser_decisions::void,
        start_day::check_open,
    },
    queries,
    store::Store,
    tables::{
        counting_evaluations, days, evaluation_specs,
        evaluations::Evaluation,
        run_plan::RunPlan,
        season, stage_runtimes,
        stages::{self, Stage},
        submissions, teams,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, SeedLabel, StageDay, TeamId};
use jiff::Timestamp;

/// The stage with the rules of the day's other evaluations; with its current rules if there are none.
async fn rules_of_day(tx: &mut Tx, stage: Stage, stage_day: StageDay) -> Result<Stage> {
    let Some(number) = counting_evaluations::revision_of_day(tx, stage_day).await? else {
        return Ok(stage);
    };
    let revisions = stages::revisions(tx, stage.id).await?;
    let revision = revisions
        .into_iter()
        .find(|revision| revision.number == number);
    let revision = revision
        .ok_or_else(|| StoreError::Damaged(format!("revision {number} of a stage is missing")))?;
    Ok(Stage { revision, ..stage })
}

impl Store {
    /// Queues an extra evaluation of a team's active submission for a day past its cutoff. Before the day's release
    /// it uses the day's episodes; afterwards these are public, so it gets episodes of its own. With `replaces`, a
    /// counting result of the day is voided first. [`StoreError::NotFound`] if the day had no cutoff.
    /// [`StoreError::Conflict`] if the team has no active submission, the day's rules exclude it, an evaluation of the day
    /// is open, or one counts and is not to be replaced. [`StoreError::Disqualified`],
    /// [`StoreError::StageNotOpen`], [`StoreError::SeasonClosed`].
    #[boxed_future]
    pub async fn add_extra_evaluation(
        &self,
        actor: Actor,
        stage_day: StageDay,
        team: TeamId,
        reason: &str,
        replaces: bool,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage = stages::find(tx, stage_day.stage).await?;
            check_open(&stage, now)?;
            let day = days::find(tx, stage_day).await?;
            teams::find(tx, team).await?;
            teams::check_may_compete(tx, team).await?;
            let active = submissions::active(tx).await?;
            let Some(active) = active.into_iter().find(|submission| submission.team == team) else {
                return StoreError::conflict(
                    "the team has no active submission: it has to upload one, or choose one, first",
                );
            };
            let stage = rules_of_day(tx, stage, stage_day).await?;
            stage
                .check_accepts(&active)
                .map_err(|refusal| stage_runtimes::conflict(&refusal))?;
            for evaluation in counting_evaluations::of_day(tx, stage_day, Some(team)).await? {
                if evaluation.is_open {
                    return StoreError::conflict(
                        "an evaluation of the team on that day is queued or running: cancel it, or wait for its end",
                    );
                }
                if evaluation.counts && !replaces {
                    return StoreError::conflict(
                        "the team has a counting evaluation of that day: an extra evaluation would replace it",
                    );
                }
                if evaluation.counts {
                    let void_reason = format!("replaced by an extra evaluation: {reason}");
                    void(tx, evaluation.id, &void_reason).await?;
                }
            }
            let id = EvaluationId::new();
            let plan: RunPlan = stage.plan();
            let setup = DaySetup {
                stage_day,
                revision: stage.revision.number,
                seed: match day.released_at {
                    None => stage.seed_label(stage_day.date),
                    Some(_) => SeedLabel::Extra(id),
                },
                ruleset: stage.revision.rules.ruleset,
                plan,
            };
            let new = NewEvaluation {
                id,
                submission: active.id,
                team,
                rerun_of: None,
            };
            queue_evaluation(tx, new, &setup, NO_DELAY_S).await?;
            evaluation_specs::set_extra(tx, id, reason).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Evaluation(id), Event::ExtraEvaluationAdded { reason });
            queries::evaluations::find(tx, id).await
        })
        .await
    }
}
