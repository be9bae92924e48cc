//! Entrants: the teams that take part in a tournament. They are added between rounds, and leave by withdrawal or
//! disqualification.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::tournament::game_lifecycle,
    store::Store,
    tables::{
        entrants::{self, Departure},
        games::{self, GamePurpose, GameState},
        rounds, season, teams,
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{DepartureKind, RoundNumber, TeamId, TournamentFormat, TournamentId};
use jiff::Timestamp;
use std::collections::BTreeSet;

/// A request that a team leaves a tournament.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepartureRequest {
    pub team: TeamId,
    pub kind: DepartureKind,
    /// First round whose games with the team do not count; `None`: the latest that is possible.
    pub from_round: Option<RoundNumber>,
    /// Public.
    pub reason: String,
}

/// Refuses new entrants while a round is open, or once the groups are drawn.
async fn check_accepts_entrants(tx: &mut Tx, tournament: &Tournament) -> Result<()> {
    let has_rounds = rounds::count(tx, tournament.id).await? > 0;
    if has_rounds && matches!(tournament.rules.format, TournamentFormat::Groups { .. }) {
        return StoreError::conflict(
            "the groups are drawn, so no team can be added: open another tournament",
        );
    }
    if !games::pending_of_rounds(tx, tournament.id)
        .await?
        .is_empty()
    {
        return StoreError::conflict(
            "a round is under way: teams can be added before the first round, or between two",
        );
    }
    Ok(())
}

/// Cancels a team's games that have no result. Those of rounds before `played_until` stay: the team still plays them.
async fn cancel_open_games(
    tx: &mut Tx,
    id: TournamentId,
    team: TeamId,
    played_until: Option<RoundNumber>,
    reason: &str,
) -> Result<()> {
    let mut games = games::of_rounds(tx, id).await?;
    games.extend(
        games::test_and_friendly(tx, id, Some(team))
            .await?
            .into_iter()
            .filter(|game| game.state.is_open()),
    );
    let mut rounds = BTreeSet::new();
    for game in games {
        let is_over = matches!(
            game.state,
            GameState::Played(_) | GameState::Cancelled { .. }
        );
        let is_still_played = matches!(
            game.purpose,
            GamePurpose::Round(schedule_entry) if played_until.is_some_and(|until| schedule_entry.round < until)
        );
        if is_over || is_still_played || !game.teams.contains(&team) {
            continue;
        }
        game_lifecycle::cancel(tx, &game, reason).await?;
        if let GamePurpose::Round(schedule_entry) = game.purpose {
            rounds.insert(schedule_entry.round);
        }
    }
    for round in rounds {
        game_lifecycle::end_round_if_over(tx, id, round).await?;
    }
    Ok(())
}

/// The round from which a departure takes effect: the newest round if a result of it is missing, else the next one.
/// Reruns of earlier rounds' games do not make those rounds current.
async fn current_round(tx: &mut Tx, id: TournamentId) -> Result<RoundNumber> {
    let newest = rounds::count(tx, id).await?;
    let pending = games::pending_of_rounds(tx, id).await?;
    let is_under_way = pending.iter().any(|pending| pending.round.get() == newest);
    round_number(if is_under_way { newest } else { newest + 1 })
}

fn round_number(number: u32) -> Result<RoundNumber> {
    RoundNumber::try_from(number)
        .map_err(|_| StoreError::Conflict("all possible rounds have been played".into()))
}

/// The latest round from which a departure may take effect.
async fn latest_round(
    tx: &mut Tx,
    tournament: &Tournament,
    kind: DepartureKind,
) -> Result<RoundNumber> {
    if tournament.rules.finishes_round(kind) {
        round_number(rounds::count(tx, tournament.id).await? + 1)
    } else {
        current_round(tx, tournament.id).await
    }
}

impl Store {
    /// Adds teams to a tournament, from the next round on. [`StoreError::Conflict`] while a round is open, once the groups
    /// are drawn, or if a team is in the tournament already or has left it.
    #[boxed_future]
    pub async fn add_entrants(
        &self,
        actor: Actor,
        id: TournamentId,
        added: &[TeamId],
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let tournament = tournaments::find_open(tx, id).await?;
            check_accepts_entrants(tx, &tournament).await?;
            let entrants = entrants::all(tx, id).await?;
            for team in added {
                let team = teams::find(tx, *team).await?;
                if let Some(entrant) = entrants.iter().find(|entrant| entrant.team == team.id) {
                    let obstacle = match entrant.departure {
                        None => "is in the tournament already",
                        Some(_) => "has left the tournament for good",
                    };
                    return StoreError::conflict(format!("{} {obstacle}", team.name));
                }
                entrants::put(tx, id, team.id, now).await?;
            }
            let teams = added.to_vec();
            tx.record(Subject::Tournament(id), Event::TeamsEntered { teams });
            Ok(())
        })
        .await
    }

    /// Removes a team from a tournament for good. From the current round on (between rounds: from the next one) its games do not
    /// count, and those without a result are cancelled. A team that withdraws plays the round under way to its end, if the rules of the
    /// tournament say so. The games of a disqualified team can stop counting
    /// from an earlier round on (`from_round`). Before the first round the team is only removed (`None`) and can be added again. A team that
    /// withdrew can be disqualified later. [`StoreError::Conflict`] if it has left in another way, is not an entrant, or the
    /// tournament is closed.
    #[boxed_future]
    pub async fn leave_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        request: &DepartureRequest,
        now: Timestamp,
    ) -> Result<Option<Departure>> {
        self.write(actor, now, async |tx| {
            let tournament = tournaments::find_open(tx, id).await?;
            remove_entrant(tx, &tournament, request).await
        })
        .await
    }
}

/// Removes a team from a tournament that is not closed.
pub(crate) async fn remove_entrant(
    tx: &mut Tx,
    tournament: &Tournament,
    request: &DepartureRequest,
) -> Result<Option<Departure>> {
    let id = tournament.id;
    let DepartureRequest {
        team,
        kind,
        from_round,
        ref reason,
    } = *request;
    let entrants = entrants::all(tx, id).await?;
    let Some(entrant) = entrants.iter().find(|entrant| entrant.team == team) else {
        return StoreError::conflict("the team is not in the tournament");
    };
    let cancel_reason = format!("{} has left the tournament", entrant.name);
    let latest_round = match (&entrant.departure, kind) {
        (None, _) if rounds::count(tx, id).await? == 0 => {
            entrants::remove(tx, id, team).await?;
            cancel_open_games(tx, id, team, None, &cancel_reason).await?;
            let reason = reason.clone();
            tx.record(
                Subject::Tournament(id),
                Event::EntrantRemoved { team, reason },
            );
            return Ok(None);
        }
        (None, _) => latest_round(tx, tournament, kind).await?,
        // A team cannot avoid disqualification by withdrawing first, nor delay it.
        (Some(earlier), DepartureKind::Disqualified)
            if earlier.kind == DepartureKind::Withdrawn =>
        {
            earlier.from_round.min(current_round(tx, id).await?)
        }
        (Some(_), _) => {
            return StoreError::conflict(format!(
                "{} has left the tournament already",
                entrant.name
            ));
        }
    };
    let from_round = from_round.unwrap_or(latest_round);
    if from_round > latest_round || kind == DepartureKind::Withdrawn && from_round < latest_round {
        let expected = match kind {
            DepartureKind::Withdrawn => {
                format!("{latest_round}: a team that withdraws keeps its results of earlier rounds")
            }
            DepartureKind::Disqualified => format!("1 to {latest_round}"),
        };
        return StoreError::conflict(format!("from_round: expected {expected}; got {from_round}"));
    }
    let departure = Departure {
        kind,
        from_round,
        at: tx.now,
        reason: reason.clone(),
    };
    entrants::set_departure(tx, id, team, &departure).await?;
    let played_until = tournament.rules.finishes_round(kind).then_some(from_round);
    cancel_open_games(tx, id, team, played_until, &cancel_reason).await?;
    let event = Event::TeamLeftTournament {
        team,
        left_as: kind,
        from_round,
        reason: reason.clone(),
    };
    tx.record(Subject::Tournament(id), event);
    Ok(Some(departure))
}
