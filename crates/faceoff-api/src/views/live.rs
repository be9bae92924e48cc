//! Events of a live game's stream that say that the game waits or has ended. The other events are about the play.

use faceoff_types::GameId;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The last event of a game's stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LiveEnd {
    /// Id of the game.
    pub game: GameId,
    /// The game's state. `GET /games/{id}` returns the rest; a result is there a moment later.
    pub state: LiveEndState,
}

/// State of a game that is neither running nor queued.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LiveEndState {
    /// It has a result.
    Played,
    /// It was given up after a platform fault.
    #[serde(rename = "broken")]
    PlatformFailed,
    /// An organiser voided its result.
    Void,
    /// It is not played.
    Cancelled,
}

/// The game waits for a slot, a place in which one job runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LiveWait {
    /// Id of the game.
    pub game: GameId,
}
