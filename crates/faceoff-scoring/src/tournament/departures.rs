//! Teams that leave in the middle, and what counts then.

use super::game::PlayedGame;
use faceoff_types::{LeftAs, RoundNumber, TeamName};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A team that left.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Departure {
    /// The team.
    pub team: TeamName,
    /// How.
    #[serde(rename = "as")]
    pub left_as: LeftAs,
    /// The first round whose games with the team do not count: the one that was under way, or, between
    /// two rounds, the next. An organiser may name an earlier one for a disqualified team; 1 takes out
    /// all that it played.
    pub from_round: RoundNumber,
}

/// All teams that left, each once.
///
/// The rule: games of rounds that were finished before the team left count, for everybody. Games with
/// the team in the unfinished round are taken out for everybody, the played ones too, since otherwise
/// those who had already met it would have points that the others can no longer get.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Departures(BTreeMap<TeamName, (LeftAs, RoundNumber)>);

/// A team leaves once.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0} is said to leave twice; keep the one that counts")]
pub struct LeavesTwice(TeamName);

impl Departures {
    /// From a list in any order.
    ///
    /// # Errors
    /// If a team is in it twice.
    pub fn new(list: impl IntoIterator<Item = Departure>) -> Result<Self, LeavesTwice> {
        let mut all = BTreeMap::new();
        for departure in list {
            let Departure {
                team,
                left_as,
                from_round,
            } = departure;
            if all.contains_key(&team) {
                return Err(LeavesTwice(team));
            }
            all.insert(team, (left_as, from_round));
        }
        Ok(Self(all))
    }

    /// The team by whose leaving the game does not count; the home team if both left.
    #[must_use]
    pub fn taken_out_by<'a>(&self, game: &'a PlayedGame) -> Option<&'a TeamName> {
        game.teams()
            .into_iter()
            .find(|team| self.takes_out(team, game.round()))
    }

    /// Does what a team had in a round count no more?
    #[must_use]
    pub fn takes_out(&self, team: &TeamName, round: u32) -> bool {
        self.0
            .get(team)
            .is_some_and(|(_, from)| round >= from.get())
    }

    /// The games that count.
    pub fn counting<'a>(&'a self, games: &'a [PlayedGame]) -> impl Iterator<Item = &'a PlayedGame> {
        games
            .iter()
            .filter(|game| self.taken_out_by(game).is_none())
    }

    /// How a team left, if it did.
    #[must_use]
    pub fn left_as(&self, team: &TeamName) -> Option<LeftAs> {
        self.0.get(team).map(|(left_as, _)| *left_as)
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
