//! Formats of a tournament: the ways to decide which teams play each other in each round.

use crate::RoundNumber;
use serde::{Deserialize, Serialize};

/// Format of a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum TournamentFormat {
    /// In every round, each team plays each other team once. The challenge had two rounds, the second with sides
    /// swapped.
    RoundRobin {
        /// Number of rounds, in each of which all teams play each other.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 100))]
        rounds: RoundNumber,
    },
    /// A first round in drawn groups, each a round robin, and a final round robin among the best of each group. With
    /// two groups and one team to advance, the final is a single game.
    Groups {
        /// Number of groups.
        groups: u32,
        /// Teams of each group that reach the final.
        advance: u32,
    },
    /// In every round, each team plays one game against a team of similar rank that it has not played before.
    Swiss {
        /// Number of rounds.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 100))]
        rounds: RoundNumber,
    },
}

impl TournamentFormat {
    /// The number of the last round.
    #[must_use]
    pub fn last_round(&self) -> RoundNumber {
        match self {
            Self::RoundRobin { rounds } | Self::Swiss { rounds } => *rounds,
            Self::Groups { .. } => RoundNumber::SECOND,
        }
    }
}

/// The format of the 2023 Robot Air Hockey Challenge: all teams play each other twice.
impl Default for TournamentFormat {
    fn default() -> Self {
        Self::RoundRobin {
            rounds: RoundNumber::SECOND,
        }
    }
}
