use crate::RoundNumber;
use serde::{Deserialize, Serialize};

/// How a tournament is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum TournamentFormat {
    /// In every round everybody meets everybody once: one round, or two with sides swapped, as the
    /// challenge had it.
    RoundRobin {
        /// How many times everybody meets everybody.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 100))]
        rounds: RoundNumber,
    },
    /// A first round in drawn groups, each a round robin; a final round among the best of them, a round
    /// robin again: with two groups and one to advance, a single game.
    Groups {
        /// How many groups.
        groups: u32,
        /// How many of each reach the final.
        advance: u32,
    },
    /// A number of rounds in each of which everybody has one game, against somebody who stands near and
    /// was not met before.
    Swiss {
        /// How many rounds.
        #[cfg_attr(feature = "openapi", schema(value_type = u32, minimum = 1, maximum = 100))]
        rounds: RoundNumber,
    },
}

impl TournamentFormat {
    /// How many rounds there are.
    #[must_use]
    pub fn last_round(&self) -> RoundNumber {
        match self {
            Self::RoundRobin { rounds } | Self::Swiss { rounds } => *rounds,
            Self::Groups { .. } => RoundNumber::SECOND,
        }
    }
}

/// As the challenge had it: everybody meets everybody twice.
impl Default for TournamentFormat {
    fn default() -> Self {
        Self::RoundRobin {
            rounds: RoundNumber::SECOND,
        }
    }
}
