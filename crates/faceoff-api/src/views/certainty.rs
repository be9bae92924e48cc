//! How sure a champion is.

use faceoff_scoring::tournament::ChampionShare;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What came of playing the whole schedule again: who would have been champion how often.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CertaintyView {
    /// How often the schedule was to be played again.
    pub replays: u32,
    /// Of these, the ones whose games that count are all played; the others are not in `champions`.
    pub complete: u32,
    /// Of these, the ones that were called off or broken before.
    pub given_up: u32,
    /// Of all games of all replays, those that are to be played.
    pub games: u32,
    /// Of these, the ones that are.
    pub games_played: u32,
    /// The shares of all teams that came first at least once, the largest first.
    pub champions: Vec<ChampionShare>,
}
