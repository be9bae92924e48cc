//! A time that a slot began a game: kept apart from what the game came to.

use crate::views::shown;
use faceoff_store::{AttemptOutcome, GameAttempt};
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

impl From<GameAttempt> for AttemptView {
    fn from(attempt: GameAttempt) -> Self {
        let end = attempt.end.as_ref().map(|end| match end.how {
            AttemptOutcome::Played => AttemptEndView::Played,
            AttemptOutcome::Broken => AttemptEndView::Broken,
            AttemptOutcome::GivenBack => AttemptEndView::GivenBack,
            AttemptOutcome::Lost => AttemptEndView::Lost,
            AttemptOutcome::CalledOff => AttemptEndView::CalledOff,
        });
        Self {
            number: attempt.number,
            worker: attempt.worker,
            begun_at: attempt.begun_at,
            ended_at: attempt.end.as_ref().map(|end| end.at),
            end,
            reason: attempt.end.and_then(|end| end.reason).map(shown),
        }
    }
}
