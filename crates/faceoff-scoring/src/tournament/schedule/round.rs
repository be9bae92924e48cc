//! The schedule of a round: its games, divided into matchdays.

use faceoff_types::{RoundNumber, TeamName};
use serde::{Deserialize, Serialize};

/// A scheduled game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pairing {
    /// The team of the first robot.
    pub home: TeamName,
    /// The team of the second robot.
    pub away: TeamName,
}

impl Pairing {
    /// Both teams, home team first.
    #[must_use]
    pub const fn teams(&self) -> [&TeamName; 2] {
        [&self.home, &self.away]
    }

    /// Whether the game is between these two teams, regardless of the home side.
    #[must_use]
    pub fn is_between(&self, teams: [&TeamName; 2]) -> bool {
        let [home, away] = self.teams();
        [home, away] == teams || [away, home] == teams
    }
}

/// Games that can run in parallel: each team has at most one.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Matchday {
    /// The games of the day.
    pub pairings: Vec<Pairing>,
    /// Teams without an opponent on this day.
    pub byes: Vec<TeamName>,
}

/// The schedule of a round.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// Number of the round, from 1.
    pub number: RoundNumber,
    /// The teams of each group; absent for formats without groups.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<Vec<TeamName>>,
    /// The matchdays in the order of play.
    pub matchdays: Vec<Matchday>,
}

impl Round {
    /// All games, in the order of play.
    pub fn pairings(&self) -> impl Iterator<Item = &Pairing> {
        self.matchdays.iter().flat_map(|day| &day.pairings)
    }

    /// All byes, in the order of play.
    pub fn byes(&self) -> impl Iterator<Item = &TeamName> {
        self.matchdays.iter().flat_map(|day| &day.byes)
    }
}
