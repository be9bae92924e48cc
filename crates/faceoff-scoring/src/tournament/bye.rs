//! Byes: rounds in which a team has no opponent.

use faceoff_types::{RoundNumber, TeamName};
use serde::{Deserialize, Serialize};

/// Points of a bye in a Swiss tournament, the same as of a won game, so that a bye is no disadvantage. In round robins all
/// teams have equally many byes, and they give no points.
pub const POINTS_BYE: u32 = super::rules::POINTS_WIN;

/// A round in which a team had no opponent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bye {
    /// The round without a game.
    pub round: RoundNumber,
    /// The team without an opponent.
    pub team: TeamName,
}
