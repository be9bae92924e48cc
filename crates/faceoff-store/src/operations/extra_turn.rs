//! One more evaluation of a day for one team: one that had none, or whose counting one is to be replaced.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        enter::{Entrant, Turn, enter},
        rulings::void,
        start_day::check_open,
    },
    reads,
    store::Store,
    tables::{
        days, entries,
        evaluations::Evaluation,
        plan::RunPlan,
        season, stage_runtimes,
        stages::{self, Stage},
        standings, submissions, teams,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, SeedLabel, StageDay, TeamId};
use jiff::Timestamp;

/// The rules that the others of the day play by; those of now, if there are no others.
async fn rules_of_day(tx: &mut Tx, stage: Stage, of: StageDay) -> Result<Stage> {
    let Some(number) = standings::revision_of_day(tx, of).await? else {
        return Ok(stage);
    };
    let revisions = stages::revisions(tx, stage.id).await?;
    let rules = revisions.into_iter().find(|rules| rules.number == number);
    let rules = rules
        .ok_or_else(|| StoreError::Damaged(format!("revision {number} of a stage is missing")))?;
    Ok(Stage { rules, ..stage })
}

impl Store {
    /// Gives a team a turn of a day that has been cut, with what it has active now. While the day is under way it plays
    /// the day's episodes; once that is released, episodes of its own, since the day's are known. A result of the day
    /// that counts is voided first, if `replaces` says so. [`StoreError::NotFound`] if the day had no cut,
    /// [`StoreError::Conflict`] if the team has nothing active, has one of the day under way, or one that counts and is
    /// not to be replaced, or if the day's rules do not take what it has active; [`StoreError::Disqualified`], [`StoreError::StageNotOpen`],
    /// [`StoreError::SeasonClosed`].
    #[boxed]
    pub async fn extra_turn(
        &self,
        actor: Actor,
        of: StageDay,
        team: TeamId,
        reason: &str,
        replaces: bool,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let stage = stages::find(tx, of.stage).await?;
            check_open(&stage, now)?;
            let day = days::find(tx, of).await?;
            teams::find(tx, team).await?;
            teams::check_may_play(tx, team).await?;
            let active = submissions::active(tx).await?;
            let Some(active) = active.into_iter().find(|one| one.team == team) else {
                return Err(StoreError::Conflict(
                    "the team has no submission active: it uploads one, or chooses one, and then it can play".into(),
                ));
            };
            let stage = rules_of_day(tx, stage, of).await?;
            stage
                .check_takes(&active)
                .map_err(|why| stage_runtimes::conflict(&why))?;
            for standing in standings::of_day_and_team(tx, of, team).await? {
                if standing.is_open {
                    return Err(StoreError::Conflict(
                        "the team has an evaluation of the day under way: cancel it, or wait for its end".into(),
                    ));
                }
                if standing.counts && !replaces {
                    return Err(StoreError::Conflict(
                        "the team has an evaluation of the day that counts: an extra turn would replace it".into(),
                    ));
                }
                if standing.counts {
                    let why = format!("replaced by an extra turn: {reason}");
                    void(tx, standing.id, &why).await?;
                }
            }
            let id = EvaluationId::new();
            let plan: RunPlan = stage.plan();
            let turn = Turn {
                of,
                revision: stage.rules.number,
                seed: match day.released_at {
                    None => stage.seed_label(of.date),
                    Some(_) => SeedLabel::Extra(id),
                },
                ruleset: stage.rules.rules.ruleset,
                plan,
            };
            let entrant = Entrant {
                id,
                submission: active.id,
                team,
                rerun_of: None,
            };
            enter(tx, entrant, &turn, 0).await?;
            entries::set_extra(tx, id, reason).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Evaluation(id), Event::ExtraTurnGiven { reason });
            reads::evaluations::find(tx, id).await
        })
        .await
    }
}
