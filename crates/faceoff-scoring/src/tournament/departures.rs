//! Teams that leave during a tournament, and the games that count afterwards.

use super::game::PlayedGame;
use faceoff_types::{DepartureKind, RoundNumber, TeamName};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The departure of a team during a tournament.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Departure {
    /// The team that left.
    pub team: TeamName,
    /// Withdrawn or disqualified.
    #[serde(rename = "as")]
    pub kind: DepartureKind,
    /// The first round whose games with the team do not count: the current one or, between two rounds, the next. Under rules by which a
    /// team that withdraws still plays the current round, it is the round after. For a disqualified team an organiser may choose an earlier
    /// round; 1 excludes all its games.
    pub from_round: RoundNumber,
}

/// All departures, at most one for each team.
///
/// Games of earlier rounds count for both sides. If a departure takes effect in the middle of a round, all games of this round with the
/// team are excluded, including finished ones. Otherwise opponents that had already met it would have points that the others can no
/// longer get.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Departures(BTreeMap<TeamName, (DepartureKind, RoundNumber)>);

/// Two departures of the same team.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0} has two departures; keep the one that counts")]
pub struct DuplicateDeparture(TeamName);

impl Departures {
    /// Collects a list in any order.
    ///
    /// # Errors
    /// If a team is listed twice.
    pub fn new(list: impl IntoIterator<Item = Departure>) -> Result<Self, DuplicateDeparture> {
        let mut by_team = BTreeMap::new();
        for departure in list {
            let Departure {
                team,
                kind,
                from_round,
            } = departure;
            if by_team.contains_key(&team) {
                return Err(DuplicateDeparture(team));
            }
            by_team.insert(team, (kind, from_round));
        }
        Ok(Self(by_team))
    }

    /// The team whose departure excludes the game; the home team if both left. `None` if the game counts.
    #[must_use]
    pub fn excluded_by<'a>(&self, game: &'a PlayedGame) -> Option<&'a TeamName> {
        game.teams()
            .into_iter()
            .find(|team| self.excludes(team, game.round()))
    }

    /// Are the games and byes of a team in a round excluded?
    #[must_use]
    pub fn excludes(&self, team: &TeamName, round: u32) -> bool {
        self.0
            .get(team)
            .is_some_and(|(_, from)| round >= from.get())
    }

    /// The games that still count.
    pub fn counting_games<'a>(
        &'a self,
        games: &'a [PlayedGame],
    ) -> impl Iterator<Item = &'a PlayedGame> {
        games.iter().filter(|game| self.excluded_by(game).is_none())
    }

    /// How a team left; `None` if it did not.
    #[must_use]
    pub fn kind(&self, team: &TeamName) -> Option<DepartureKind> {
        self.0.get(team).map(|(kind, _)| *kind)
    }

    /// The teams that left, by name.
    pub fn teams(&self) -> impl Iterator<Item = &TeamName> {
        self.0.keys()
    }

    /// Whether a team has left.
    #[must_use]
    pub fn contains(&self, team: &TeamName) -> bool {
        self.0.contains_key(team)
    }
}
