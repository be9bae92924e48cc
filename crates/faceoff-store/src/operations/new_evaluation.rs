//! Adds one evaluation (a team's run of all tasks) to a day: at the day's cutoff, as a rerun, or as an extra evaluation.

use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{job_purpose, runs},
    queue::NewJob,
    tables::{
        days,
        evaluation_specs::{self, EvaluationSpec},
        run_plan::RunPlan,
        runs::Run,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Ruleset, RunId, SeedLabel, StageDay, SubmissionId, TeamId};

/// The submission of an evaluation that is to be added.
pub(crate) struct NewEvaluation {
    pub(crate) id: EvaluationId,
    pub(crate) submission: SubmissionId,
    pub(crate) team: TeamId,
    /// The earlier evaluation that it repeats.
    pub(crate) rerun_of: Option<EvaluationId>,
}

/// Rules, seed and plan that all evaluations of a day share.
pub(crate) struct DaySetup {
    pub(crate) stage_day: StageDay,
    /// Revision of the stage's rules.
    pub(crate) revision: u32,
    pub(crate) seed: SeedLabel,
    pub(crate) ruleset: Ruleset,
    pub(crate) plan: RunPlan,
}

/// The delay of shards that may run at once, in seconds.
pub(crate) const NO_DELAY_S: u32 = 0;

/// Adds an evaluation of a day and queues its shards, to be run after `delay_s` seconds at the earliest.
/// [`Conflict`](crate::StoreError::Conflict) if the team already has a counting one of that day.
pub(crate) async fn queue_evaluation(
    tx: &mut Tx,
    requested: NewEvaluation,
    setup: &DaySetup,
    delay_s: u32,
) -> Result<EvaluationId> {
    let run = Run {
        id: RunId::new(),
        ruleset: setup.ruleset,
        plan: setup.plan.clone(),
        seed: setup.seed,
        keeps_recordings: true,
    };
    // Unreleased days are run in the order of their cutoffs. Evaluations of a released day queue as if its cutoff were now.
    let day = days::find(tx, setup.stage_day).await?;
    let queued_as_of = match day.released_at {
        None => day.cutoff_at,
        Some(_) => tx.now,
    };
    let job = NewJob {
        delay_s,
        batch: queued_as_of.as_millisecond(),
        ..job_purpose::SHARD
    };
    runs::queue_run(tx, &run, &[requested.submission], job, requested.team).await?;
    let spec = EvaluationSpec {
        id: requested.id,
        submission: requested.submission,
        team: requested.team,
        stage_day: setup.stage_day,
        revision: setup.revision,
        run: run.id,
        rerun_of: requested.rerun_of,
    };
    let now = tx.now;
    evaluation_specs::insert(tx, &spec, now).await?;
    tx.record(
        Subject::Evaluation(spec.id),
        Event::EvaluationQueued {
            team: spec.team,
            submission: spec.submission,
            stage: Some(spec.stage_day.stage),
            day: spec.stage_day.date,
            run: spec.run,
            rerun_of: spec.rerun_of,
        },
    );
    Ok(spec.id)
}
