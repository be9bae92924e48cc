//! A time that a slot began a game: kept apart from what the game came to.

use faceoff_api::views::{
    attempt::{AttemptEndView, AttemptView},
    shown,
};
use faceoff_store::{AttemptOutcome, GameAttempt};

/// An attempt at a game.
pub fn of(attempt: GameAttempt) -> AttemptView {
    let end = attempt.end.as_ref().map(|end| match end.how {
        AttemptOutcome::Played => AttemptEndView::Played,
        AttemptOutcome::Broken => AttemptEndView::Broken,
        AttemptOutcome::GivenBack => AttemptEndView::GivenBack,
        AttemptOutcome::Lost => AttemptEndView::Lost,
        AttemptOutcome::CalledOff => AttemptEndView::CalledOff,
    });
    AttemptView {
        number: attempt.number,
        worker: attempt.worker,
        begun_at: attempt.begun_at,
        ended_at: attempt.end.as_ref().map(|end| end.at),
        end,
        reason: attempt.end.and_then(|end| end.reason).map(shown),
    }
}
