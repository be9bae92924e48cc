//! One evaluation of a day: what every cut and every re-run is made of.

use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{purpose, runs},
    queue::NewUnit,
    tables::{
        days,
        entries::{self, Entry},
        plan::RunPlan,
        runs::Run,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Ruleset, RunId, SeedLabel, StageDay, SubmissionId, TeamId};

/// Who plays a day.
pub(crate) struct Entrant {
    pub(crate) id: EvaluationId,
    pub(crate) submission: SubmissionId,
    pub(crate) team: TeamId,
    pub(crate) rerun_of: Option<EvaluationId>,
}

/// What all play on a day.
pub(crate) struct Turn {
    pub(crate) of: StageDay,
    /// Of the stage's rules.
    pub(crate) revision: u32,
    pub(crate) seed: SeedLabel,
    pub(crate) ruleset: Ruleset,
    pub(crate) plan: RunPlan,
}

/// Adds an evaluation of a day and queues its shards, to be played after `rest_s` seconds.
/// [`Conflict`](crate::StoreError::Conflict) if the team has one of the day that counts.
pub(crate) async fn enter(
    tx: &mut Tx,
    entrant: Entrant,
    turn: &Turn,
    rest_s: u32,
) -> Result<EvaluationId> {
    let run = Run {
        id: RunId::new(),
        ruleset: turn.ruleset,
        plan: turn.plan.clone(),
        seed: turn.seed,
        keeps_recordings: true,
    };
    // An unfinished day goes on before a later one; what is played of a released day waits with what comes now.
    let day = days::find(tx, turn.of).await?;
    let queued_as_of = match day.released_at {
        None => day.cut_at,
        Some(_) => tx.now,
    };
    let unit = NewUnit {
        rest_s,
        batch: queued_as_of.as_millisecond(),
        ..purpose::SHARD
    };
    runs::create(tx, &run, &[entrant.submission], unit, entrant.team).await?;
    let new = Entry {
        id: entrant.id,
        submission: entrant.submission,
        team: entrant.team,
        of: turn.of,
        revision: turn.revision,
        run: run.id,
        rerun_of: entrant.rerun_of,
    };
    let now = tx.now;
    entries::insert(tx, &new, now).await?;
    tx.record(
        Subject::Evaluation(new.id),
        Event::EvaluationQueued {
            team: new.team,
            submission: new.submission,
            stage: Some(new.of.stage),
            day: new.of.date,
            run: new.run,
            rerun_of: new.rerun_of,
        },
    );
    Ok(new.id)
}
