//! What is told of a game as it is watched, beside the happenings and positions themselves.

use faceoff_types::GameId;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Nothing more is told of a game: the last event of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LiveEnd {
    /// Which.
    pub game: GameId,
    /// How it stands then; `GET /games/{id}` has the rest, a result a moment later.
    pub state: LiveEndState,
}

/// How a game stands that nobody plays, and that nobody is about to play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LiveEndState {
    /// It was played to its end.
    Played,
    /// Our fault, given up.
    Broken,
    /// Its result counts no more.
    Void,
    /// It is not played.
    Cancelled,
}

/// A game waits for a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LiveWait {
    /// Which.
    pub game: GameId,
}
