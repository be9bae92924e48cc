//! Positions in the queue of jobs, with the time at which each evaluation or validation run is expected to end.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_api::views::queue::QueueView;
use faceoff_store::{QueueForecast, QueuePosition};
use jiff::{RoundMode, Timestamp, TimestampRound, Unit};

pub fn view(position: QueuePosition) -> QueueView {
    QueueView {
        position: position.position,
        total: position.total,
        expected_at: position.expected_at.map(next_minute),
    }
}

/// The end of the minute: a finer forecast would show teams the pace of their agents' episodes.
fn next_minute(at: Timestamp) -> Timestamp {
    let minute = TimestampRound::new()
        .smallest(Unit::Minute)
        .mode(RoundMode::Ceil);
    at.round(minute).unwrap_or(at)
}

/// Number of slots that run jobs now: the server's own and those of remote workers.
pub fn slots(app: &AppState) -> u32 {
    let remote = app.live.workers.available_slots(app.config.clock.now());
    app.config.capacity.slots + remote
}

/// Positions and expected completion of all pending and running evaluations and validation runs.
#[boxed_future]
pub async fn forecast(app: &AppState) -> Result<QueueForecast, Problem> {
    let now = app.config.clock.now();
    Ok(app.store.queue_forecast(slots(app), now).await?)
}
