use faceoff_types::{RoundNumber, TeamName};
use serde::{Deserialize, Serialize};

/// A game to be played.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pairing {
    /// The team of the first robot.
    pub home: TeamName,
    /// The team of the second robot.
    pub away: TeamName,
}

impl Pairing {
    /// Both teams, home first.
    #[must_use]
    pub const fn teams(&self) -> [&TeamName; 2] {
        [&self.home, &self.away]
    }

    /// Whether these two meet, whoever is at home.
    #[must_use]
    pub fn is_between(&self, teams: [&TeamName; 2]) -> bool {
        let [home, away] = self.teams();
        [home, away] == teams || [away, home] == teams
    }
}

/// Games that can be played side by side: no team is in two of them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Matchday {
    /// The games.
    pub pairings: Vec<Pairing>,
    /// Who has nobody to play.
    pub byes: Vec<TeamName>,
}

/// A round, as it was drawn.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// From 1.
    pub number: RoundNumber,
    /// Who plays in which group, where there are groups.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<Vec<TeamName>>,
    /// The games in the order of play.
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
