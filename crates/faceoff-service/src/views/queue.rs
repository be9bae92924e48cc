//! Where something stands in the queue.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::queue::QueueView;
use faceoff_store::{Outlook, QueuePlace};

/// A place in the queue.
pub fn of(place: QueuePlace) -> QueueView {
    QueueView {
        place: place.place,
        of: place.of,
        expected_at: place.expected_at,
    }
}

/// Slots that play now, here and on other machines.
pub fn slots(app: &AppState) -> u32 {
    let elsewhere = app.store.workers().slots(app.config.clock.now());
    app.config.capacity.slots + elsewhere
}

/// Where everything stands that waits or is under way.
#[boxed]
pub async fn outlook(app: &AppState) -> Result<Outlook, Problem> {
    let now = app.config.clock.now();
    Ok(app.store.outlook(slots(app), now).await?)
}
