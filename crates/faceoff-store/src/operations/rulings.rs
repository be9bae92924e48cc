//! What the organiser decides against results and teams, each at once and with a reason.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        ends,
        tournament::entrants::{Leaving, leave},
    },
    reads,
    store::Store,
    tables::{
        days, entrants, entries,
        evaluations::{Evaluation, Failure},
        finalised,
        rulings::Ruling,
        standings,
        teams::{self, Team},
        tournaments,
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, LeftAs, StageDay, TeamId};
use jiff::Timestamp;

pub(crate) async fn void(tx: &mut Tx, id: EvaluationId, reason: &str) -> Result<()> {
    let ruling = Ruling {
        at: tx.now,
        reason: reason.to_owned(),
    };
    standings::set_voided(tx, id, &ruling).await?;
    let reason = ruling.reason;
    tx.record(Subject::Evaluation(id), Event::EvaluationVoided { reason });
    Ok(())
}

/// Disqualifies a team from the tournaments that are not closed.
async fn leave_tournaments(tx: &mut Tx, team: TeamId, reason: &str) -> Result<()> {
    let leaving = Leaving {
        team,
        left_as: LeftAs::Disqualified,
        from_round: None,
        reason: reason.to_owned(),
    };
    for tournament in tournaments::all(tx).await? {
        let entrants = entrants::all(tx, tournament.id).await?;
        let is_in = entrants
            .iter()
            .any(|one| one.team == team && one.left.is_none());
        if tournament.closed_at.is_none() && is_in {
            leave(tx, tournament.id, &leaving).await?;
        }
    }
    Ok(())
}

impl Store {
    /// Takes a result off the board, or a failure of the agent off its team's day: it stays to be read, counts no
    /// more, and can be played again. [`StoreError::Conflict`] unless it has ended by the agent's doing and counts, and once its stage is signed off.
    #[boxed]
    pub async fn void_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            let of = entries::find(tx, id).await?.of;
            finalised::check_not(tx, of.stage).await?;
            let standings = standings::of_day(tx, of).await?;
            if !standings.iter().any(|standing| standing.id == id && standing.counts) {
                return Err(StoreError::Conflict(
                    "only an evaluation that is finished, or that its agent failed, and that counts is voided; \
                     one that is under way is cancelled"
                        .into(),
                ));
            }
            void(tx, id, reason).await?;
            reads::evaluations::find(tx, id).await
        })
        .await
    }

    /// Voids all that has ended of a day and cancels the rest, so that it is released. The evaluations that counted.
    /// [`StoreError::NotFound`] if the day has had no cut, [`StoreError::Conflict`] if nothing of it counts, or its stage
    /// is signed off.
    #[boxed]
    pub async fn void_day(
        &self,
        actor: Actor,
        of: StageDay,
        reason: &str,
        now: Timestamp,
    ) -> Result<u32> {
        self.write(actor, now, async |tx| {
            if !days::exists(tx, of).await? {
                return Err(StoreError::NotFound("day"));
            }
            finalised::check_not(tx, of.stage).await?;
            let mut count = 0;
            for standing in standings::of_day(tx, of).await? {
                if standing.is_open {
                    let cancelled = Failure::Cancelled(reason);
                    ends::fail_evaluation(tx, standing.id, standing.run, cancelled).await?;
                } else if standing.counts {
                    void(tx, standing.id, reason).await?;
                } else {
                    continue;
                }
                count += 1;
            }
            if count == 0 {
                return Err(StoreError::Conflict("nothing of that day counts".into()));
            }
            let reason = reason.to_owned();
            tx.record(Subject::Day(of), Event::DayVoided { reason });
            Ok(count)
        })
        .await
    }

    /// Disqualifies a team at once: what it plays is cancelled, it is on no board, at no cut, and uploads nothing; out of
    /// tournaments that are not closed it is for good.
    /// [`StoreError::Conflict`] if it is disqualified.
    #[boxed]
    pub async fn disqualify_team(
        &self,
        actor: Actor,
        id: TeamId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            if teams::find(tx, id).await?.disqualified.is_some() {
                return Err(StoreError::Conflict(
                    "the team is disqualified already".into(),
                ));
            }
            let ruling = Ruling {
                at: now,
                reason: reason.to_owned(),
            };
            teams::set_disqualified(tx, id, Some(&ruling)).await?;
            let why = format!("the team is disqualified: {reason}");
            for (evaluation, run) in standings::open_of_team(tx, id).await? {
                ends::fail_evaluation(tx, evaluation, run, Failure::Cancelled(&why)).await?;
            }
            leave_tournaments(tx, id, &why).await?;
            let reason = ruling.reason;
            tx.record(Subject::Team(id), Event::TeamDisqualified { reason });
            teams::find(tx, id).await
        })
        .await
    }

    /// Lets a disqualified team play and be ranked again; what was cancelled can be played again.
    /// [`StoreError::Conflict`] if it is not disqualified.
    #[boxed]
    pub async fn reinstate_team(
        &self,
        actor: Actor,
        id: TeamId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Team> {
        self.write(actor, now, async |tx| {
            if teams::find(tx, id).await?.disqualified.is_none() {
                return Err(StoreError::Conflict("the team is not disqualified".into()));
            }
            teams::set_disqualified(tx, id, None).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Team(id), Event::TeamReinstated { reason });
            teams::find(tx, id).await
        })
        .await
    }
}
