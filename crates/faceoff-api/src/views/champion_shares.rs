//! How certain a tournament's champion is. To estimate this, all games of the schedule are *replayed* with other seeds.

use faceoff_scoring::tournament::ChampionShare;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How often each team becomes champion when the whole schedule is replayed with other seeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChampionSharesView {
    /// Replays requested.
    pub replays: u32,
    /// Replays whose games that count have all been played; only these are counted in `champions`.
    pub complete: u32,
    /// Replays that cannot be completed, because games were cancelled or failed by a platform fault.
    pub given_up: u32,
    /// Games of all replays, cancelled ones excluded.
    pub games: u32,
    /// Games that have been played.
    pub games_played: u32,
    /// The shares of all teams that came first at least once, largest first.
    pub champions: Vec<ChampionShare>,
}
