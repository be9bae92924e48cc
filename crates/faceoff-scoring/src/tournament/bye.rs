use faceoff_types::{RoundNumber, TeamName};
use serde::{Deserialize, Serialize};

/// Points of a bye in a Swiss tournament, those of a won game: a team that was kept from playing does
/// not fall behind for it. In round robins everybody has equally many byes, and they give nothing.
pub const POINTS_BYE: u32 = super::rules::POINTS_WIN;

/// A round in which a team had nobody to play.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bye {
    /// The round.
    pub round: RoundNumber,
    /// The team.
    pub team: TeamName,
}
