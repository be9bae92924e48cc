//! One evaluation of a day: what every cut and every re-run is made of.

use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{purpose, runs},
    queue::NewUnit,
    tables::{
        evaluations::{self, Entry},
        plan::RunPlan,
        runs::Run,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Ruleset, RunId, SeedLabel, SubmissionId, TeamId};
use jiff::civil::Date;

/// What is to play a day.
pub(crate) struct Entrant {
    pub(crate) submission: SubmissionId,
    pub(crate) team: TeamId,
    pub(crate) ruleset: Ruleset,
    pub(crate) rerun_of: Option<EvaluationId>,
}

/// Adds an evaluation of `day` and queues its shards, to be played after `rest_s` seconds.
/// [`Conflict`](crate::StoreError::Conflict) if the team has one of the day that counts.
pub(crate) async fn enter(
    tx: &mut Tx,
    entrant: Entrant,
    day: Date,
    plan: &RunPlan,
    rest_s: u32,
) -> Result<EvaluationId> {
    let run = Run {
        id: RunId::new(),
        ruleset: entrant.ruleset,
        plan: plan.clone(),
        seed: SeedLabel::Day(day),
        keeps_recordings: true,
    };
    let unit = NewUnit {
        rest_s,
        ..purpose::SHARD
    };
    runs::create(tx, &run, &[entrant.submission], unit, entrant.team).await?;
    let new = Entry {
        id: EvaluationId::new(),
        submission: entrant.submission,
        team: entrant.team,
        day,
        run: run.id,
        rerun_of: entrant.rerun_of,
    };
    let now = tx.now;
    evaluations::insert(tx, &new, now).await?;
    tx.record(
        Subject::Evaluation(new.id),
        Event::EvaluationQueued {
            team: new.team,
            submission: new.submission,
            day,
            run: new.run,
            rerun_of: new.rerun_of,
        },
    );
    Ok(new.id)
}
