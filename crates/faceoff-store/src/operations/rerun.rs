//! The same submission on the same day's episodes once more: what we broke by itself, and what an
//! organiser asks for. What plays stays what was active at the cut.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::Actor,
    operations::enter::{Entrant, Turn, enter},
    reads,
    store::Store,
    tables::{
        days,
        entries::{self, Entry},
        evaluations::{self, Evaluation, EvaluationState},
        finalised, runs, season, teams,
    },
    write::Tx,
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;

/// How long what we broke rests before it is played again by itself, seconds: the first time, the second
/// time, and then no more. So a day ends whatever is broken.
pub const RERUN_PAUSES_S: [u32; 2] = [60, 600];

async fn again(tx: &mut Tx, broken: Entry, rest_s: u32) -> Result<EvaluationId> {
    let run = runs::find(tx, broken.run).await?;
    let entrant = Entrant {
        id: EvaluationId::new(),
        submission: broken.submission,
        team: broken.team,
        rerun_of: Some(broken.id),
    };
    let turn = Turn {
        of: broken.of,
        revision: broken.revision,
        seed: run.seed,
        ruleset: run.ruleset,
        plan: run.plan,
    };
    let id = enter(tx, entrant, &turn, rest_s).await?;
    entries::follow_extra(tx, id, broken.id).await?;
    Ok(id)
}

/// Queues what has just ended by our fault again: unless its day is released or past its deadline, or this was
/// tried often enough.
pub(crate) async fn after_our_fault(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let broken = entries::find(tx, id).await?;
    let day = days::find(tx, broken.of).await?;
    if day.released_at.is_some() || day.deadline_at.is_some_and(|at| at <= tx.now) {
        return Ok(());
    }
    let times = evaluations::count_broken(tx, broken.team, broken.of).await?;
    if let Some(rest_s) = RERUN_PAUSES_S.get(times.saturating_sub(1)) {
        again(tx, broken, *rest_s).await?;
    }
    Ok(())
}

impl Store {
    /// Plays an evaluation again that was cancelled or voided, not played in time, or that we broke: what was active at the cut, on the
    /// same episodes, whether the day is released or not. [`StoreError::Conflict`] if it ended otherwise,
    /// the team has another one of the day that counts, or the stage is signed off; [`StoreError::Disqualified`] if
    /// it is; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed]
    pub async fn rerun_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let found = reads::evaluations::find(tx, id).await?;
            let ended_without_result = matches!(
                found.state,
                EvaluationState::PlatformFailed { .. }
                    | EvaluationState::Cancelled { .. }
                    | EvaluationState::NotPlayed { .. }
            );
            if !ended_without_result && found.voided.is_none() {
                return Err(StoreError::Conflict(
                    "only an evaluation that was cancelled or voided, that was not played in time, or that failed by \
                     our fault, is played again"
                        .into(),
                ));
            }
            let broken = entries::find(tx, id).await?;
            finalised::check_not(tx, broken.of.stage).await?;
            teams::check_may_play(tx, broken.team).await?;
            let id = again(tx, broken, 0).await?;
            reads::evaluations::find(tx, id).await
        })
        .await
    }
}
