use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::tournament::play,
    store::Store,
    tables::{
        entrants::{self, Leave},
        games::{self, GamePurpose, GameState},
        rounds, season, teams,
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{LeftAs, RoundNumber, TeamId, TournamentFormat, TournamentId};
use jiff::Timestamp;
use std::collections::BTreeSet;

/// A team that leaves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaving {
    pub team: TeamId,
    pub left_as: LeftAs,
    /// The first round whose games with it do not count, if it is another than the one that is under way or next.
    pub from_round: Option<RoundNumber>,
    /// As everybody may read it.
    pub reason: String,
}

/// Refuses who would enter while a round is under way, or when the groups are drawn.
async fn check_enterable(tx: &mut Tx, tournament: &Tournament) -> Result<()> {
    let is_drawn = rounds::count(tx, tournament.id).await? > 0;
    if is_drawn && matches!(tournament.rules.format, TournamentFormat::Groups { .. }) {
        return Err(StoreError::Conflict(
            "the groups are drawn: nobody enters any more; open another tournament".into(),
        ));
    }
    if !games::owed(tx, tournament.id).await?.is_empty() {
        return Err(StoreError::Conflict(
            "a round is under way: teams enter before the first round, or between two".into(),
        ));
    }
    Ok(())
}

/// Calls off the games of a team that have no result.
async fn call_off(tx: &mut Tx, id: TournamentId, team: TeamId, reason: &str) -> Result<()> {
    let mut games = games::of_rounds(tx, id).await?;
    games.extend(
        games::free(tx, id, Some(team))
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
        if is_over || !game.teams.contains(&team) {
            continue;
        }
        play::call_off(tx, &game, reason).await?;
        if let GamePurpose::Round(meeting) = game.purpose {
            rounds.insert(meeting.round);
        }
    }
    for round in rounds {
        play::end_round_if_over(tx, id, round).await?;
    }
    Ok(())
}

/// The round that a team leaves from that leaves now: the newest if a result of it is owed, else the next. That a game of
/// an earlier one is to be played again makes nothing of what was finished unfinished.
async fn round_under_way(tx: &mut Tx, id: TournamentId) -> Result<RoundNumber> {
    let newest = rounds::count(tx, id).await?;
    let owed = games::owed(tx, id).await?;
    let is_under_way = owed.iter().any(|owed| owed.round.get() == newest);
    RoundNumber::try_from(if is_under_way { newest } else { newest + 1 })
        .map_err(|_| StoreError::Conflict("all rounds that there can be were played".into()))
}

impl Store {
    /// Adds teams, from the next round on. [`StoreError::Conflict`] while a round is under way, once the groups of a tournament
    /// with groups were drawn, and of a team that is in it or has left it.
    #[boxed]
    pub async fn enter_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        new: &[TeamId],
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let tournament = tournaments::find_open(tx, id).await?;
            check_enterable(tx, &tournament).await?;
            let all = entrants::all(tx, id).await?;
            for team in new {
                let team = teams::find(tx, *team).await?;
                if let Some(entrant) = all.iter().find(|entrant| entrant.team == team.id) {
                    let how = match entrant.left {
                        None => "is in it already",
                        Some(_) => "has left it, for good",
                    };
                    return Err(StoreError::Conflict(format!("{} {how}", team.name)));
                }
                entrants::put(tx, id, team.id, now).await?;
            }
            let teams = new.to_vec();
            tx.record(Subject::Tournament(id), Event::TeamsEntered { teams });
            Ok(())
        })
        .await
    }

    /// A team leaves for good: its games that have no result are called off, and no game with it counts from the round on
    /// that is under way, or, between rounds, from the next; a disqualified one may lose earlier ones, too
    /// (`from_round`). Before the first round it is just out (`None`), and may enter again. Who withdrew may be disqualified afterwards.
    /// [`StoreError::Conflict`] if it has left otherwise, or is not in it, or the tournament is closed.
    #[boxed]
    pub async fn leave_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        leaving: &Leaving,
        now: Timestamp,
    ) -> Result<Option<Leave>> {
        self.write(actor, now, async |tx| {
            tournaments::find_open(tx, id).await?;
            leave(tx, id, leaving).await
        })
        .await
    }
}

/// Takes a team out of a tournament that is not closed.
pub(crate) async fn leave(
    tx: &mut Tx,
    id: TournamentId,
    leaving: &Leaving,
) -> Result<Option<Leave>> {
    let Leaving {
        team,
        left_as,
        from_round,
        ref reason,
    } = *leaving;
    let all = entrants::all(tx, id).await?;
    let Some(entrant) = all.iter().find(|entrant| entrant.team == team) else {
        return Err(StoreError::Conflict(
            "the team is not in the tournament".into(),
        ));
    };
    let called_off = format!("{} has left the tournament", entrant.name);
    let latest = match (&entrant.left, left_as) {
        (None, _) if rounds::count(tx, id).await? == 0 => {
            entrants::remove(tx, id, team).await?;
            call_off(tx, id, team, &called_off).await?;
            let reason = reason.clone();
            tx.record(Subject::Tournament(id), Event::TeamOut { team, reason });
            return Ok(None);
        }
        (None, _) => round_under_way(tx, id).await?,
        // Nobody escapes by going first.
        (Some(left), LeftAs::Disqualified) if left.left_as == LeftAs::Withdrawn => left.from_round,
        (Some(_), _) => {
            return Err(StoreError::Conflict(format!(
                "{} has left the tournament already",
                entrant.name
            )));
        }
    };
    let from_round = from_round.unwrap_or(latest);
    if from_round > latest || left_as == LeftAs::Withdrawn && from_round < latest {
        let expected = match left_as {
            LeftAs::Withdrawn => format!("{latest}: who withdraws keeps what was finished before"),
            LeftAs::Disqualified => format!("1 to {latest}"),
        };
        return Err(StoreError::Conflict(format!(
            "from_round: expected {expected}; got {from_round}"
        )));
    }
    let leave = Leave {
        left_as,
        from_round,
        at: tx.now,
        reason: reason.clone(),
    };
    entrants::set_left(tx, id, team, &leave).await?;
    call_off(tx, id, team, &called_off).await?;
    let event = Event::TeamLeftTournament {
        team,
        left_as,
        from_round,
        reason: reason.clone(),
    };
    tx.record(Subject::Tournament(id), event);
    Ok(Some(leave))
}
