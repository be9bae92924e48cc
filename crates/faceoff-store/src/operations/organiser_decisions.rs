//! Organisers' decisions on results and teams (voiding, disqualification), which take effect at once and have a
//! reason.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        run_completion,
        tournament::entrants::{DepartureRequest, remove_entrant},
    },
    queries,
    store::Store,
    tables::{
        counting_evaluations, days,
        decision_records::DecisionRecord,
        entrants, evaluation_specs,
        evaluations::{Evaluation, Failure},
        rounds, sign_offs,
        teams::{self, Team},
        tournaments,
    },
    write::Tx,
};
use faceoff_types::{DepartureKind, EvaluationId, StageDay, TeamId};
use jiff::Timestamp;

pub(crate) async fn void(tx: &mut Tx, id: EvaluationId, reason: &str) -> Result<()> {
    let decision = DecisionRecord {
        at: tx.now,
        reason: reason.to_owned(),
    };
    counting_evaluations::set_voided(tx, id, &decision).await?;
    let reason = decision.reason;
    tx.record(Subject::Evaluation(id), Event::EvaluationVoided { reason });
    Ok(())
}

/// Disqualifies a team from the tournaments that are not closed.
async fn disqualify_from_tournaments(tx: &mut Tx, team: TeamId, reason: &str) -> Result<()> {
    let departure = DepartureRequest {
        team,
        kind: DepartureKind::Disqualified,
        from_round: None,
        reason: reason.to_owned(),
    };
    let tournaments = tournaments::all(tx).await?.into_iter();
    for tournament in tournaments.filter(|tournament| tournament.closed_at.is_none()) {
        let entrants = entrants::all(tx, tournament.id).await?;
        let rounds = rounds::count(tx, tournament.id).await?;
        // Not a team that has left, unless its games of the current round still count.
        let takes_part = entrants.iter().any(|entrant| {
            let plays = entrant.departure.as_ref().is_none_or(|departure| {
                tournament.rules.finishes_round(departure.kind)
                    && departure.from_round.get() > rounds
            });
            entrant.team == team && plays
        });
        if takes_part {
            remove_entrant(tx, &tournament, &departure).await?;
        }
    }
    Ok(())
}

impl Store {
    /// Voids a result or an agent failure: it stays readable, does not count any more, and can be rerun.
    /// [`StoreError::Conflict`] unless the evaluation counts and is finished or failed by its agent, and once its stage is
    /// signed off.
    #[boxed_future]
    pub async fn void_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            let stage_day = evaluation_specs::find(tx, id).await?.stage_day;
            sign_offs::check_not_signed_off(tx, stage_day.stage).await?;
            let counting = counting_evaluations::of_day(tx, stage_day, None).await?;
            if !counting.iter().any(|evaluation| evaluation.id == id && evaluation.counts) {
                return StoreError::conflict(
                    "only a counting evaluation that is finished, or that its agent failed, can be voided; \
                     one that is queued or running can be cancelled",
                );
            }
            void(tx, id, reason).await?;
            queries::evaluations::find(tx, id).await
        })
        .await
    }

    /// Voids all counting evaluations of a day and cancels the open ones, so that the day is released. Returns the total
    /// number. [`StoreError::NotFound`] if the day has had no cutoff, [`StoreError::Conflict`] if none counts or is open,
    /// or the stage is signed off.
    #[boxed_future]
    pub async fn void_day(
        &self,
        actor: Actor,
        stage_day: StageDay,
        reason: &str,
        now: Timestamp,
    ) -> Result<u32> {
        self.write(actor, now, async |tx| {
            if !days::exists(tx, stage_day).await? {
                return Err(StoreError::NotFound("day"));
            }
            sign_offs::check_not_signed_off(tx, stage_day.stage).await?;
            let mut count = 0;
            for evaluation in counting_evaluations::of_day(tx, stage_day, None).await? {
                if evaluation.is_open {
                    let cancelled = Failure::Cancelled(reason);
                    run_completion::fail_evaluation(tx, evaluation.id, cancelled).await?;
                } else if evaluation.counts {
                    void(tx, evaluation.id, reason).await?;
                } else {
                    continue;
                }
                count += 1;
            }
            if count == 0 {
                return StoreError::conflict("no evaluation of that day counts");
            }
            let reason = reason.to_owned();
            tx.record(Subject::Day(stage_day), Event::DayVoided { reason });
            Ok(count)
        })
        .await
    }

    /// Disqualifies a team at once. Its open evaluations are cancelled, it leaves all boards and cannot upload or be
    /// evaluated. It leaves open tournaments for good. [`StoreError::Conflict`] if it is disqualified already.
    #[boxed_future]
    pub async fn disqualify_team(
        &self,
        actor: Actor,
        id: TeamId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            if teams::find(tx, id).await?.disqualified.is_some() {
                return StoreError::conflict("the team is disqualified already");
            }
            let decision = DecisionRecord {
                at: now,
                reason: reason.to_owned(),
            };
            teams::set_disqualified(tx, id, Some(&decision)).await?;
            let cancellation_reason = format!("the team is disqualified: {reason}");
            for evaluation in counting_evaluations::open_of_team(tx, id).await? {
                let cancelled = Failure::Cancelled(&cancellation_reason);
                run_completion::fail_evaluation(tx, evaluation, cancelled).await?;
            }
            disqualify_from_tournaments(tx, id, &cancellation_reason).await?;
            let reason = decision.reason;
            tx.record(Subject::Team(id), Event::TeamDisqualified { reason });
            teams::find(tx, id).await
        })
        .await
    }

    /// Reinstates a disqualified team: it can be evaluated and is ranked again. Cancelled evaluations can be rerun.
    /// [`StoreError::Conflict`] if it is not disqualified.
    #[boxed_future]
    pub async fn reinstate_team(
        &self,
        actor: Actor,
        id: TeamId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            if teams::find(tx, id).await?.disqualified.is_none() {
                return StoreError::conflict("the team is not disqualified");
            }
            teams::set_disqualified(tx, id, None).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Team(id), Event::TeamReinstated { reason });
            teams::find(tx, id).await
        })
        .await
    }
}
