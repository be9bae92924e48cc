//! Attempts at a game. An attempt begins when a slot of a worker starts to play the game; if it ends without a result, another one follows.

use faceoff_api::views::{
    attempt::{AttemptOutcomeView, GameAttemptView},
    printable,
};
use faceoff_store::{AttemptOutcome, GameAttempt};

pub fn view(attempt: GameAttempt) -> GameAttemptView {
    let end = attempt.end.as_ref().map(|end| match end.outcome {
        AttemptOutcome::Played => AttemptOutcomeView::Played,
        AttemptOutcome::PlatformFailed => AttemptOutcomeView::PlatformFailed,
        AttemptOutcome::Released => AttemptOutcomeView::Released,
        AttemptOutcome::Lost => AttemptOutcomeView::Lost,
        AttemptOutcome::Cancelled => AttemptOutcomeView::Cancelled,
    });
    GameAttemptView {
        number: attempt.number,
        worker: attempt.worker,
        started_at: attempt.begun_at,
        ended_at: attempt.end.as_ref().map(|end| end.at),
        end,
        reason: attempt.end.and_then(|end| end.reason).map(printable),
    }
}
