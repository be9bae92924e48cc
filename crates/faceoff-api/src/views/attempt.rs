//! A time that a slot began a game: kept apart from what the game came to.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A time that a slot began a game, whatever came of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct AttemptView {
    /// From 1.
    pub number: u32,
    /// The slot.
    pub worker: String,
    /// When it began.
    pub begun_at: Timestamp,
    /// When it ended; null: it is under way.
    pub ended_at: Option<Timestamp>,
    /// What came of it; null: it is under way.
    pub end: Option<AttemptEndView>,
    /// What went wrong, or why it was voided; absent if there is nothing to tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// What came of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AttemptEndView {
    /// A result, which counts unless it was voided.
    Played,
    /// A fault of ours.
    Broken,
    /// The slot was asked to end, or found no room; it does not count against the game.
    GivenBack,
    /// The slot died.
    Lost,
    /// The game was called off meanwhile.
    CalledOff,
}
