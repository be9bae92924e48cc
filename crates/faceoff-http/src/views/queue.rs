//! Where something stands in the queue.

use crate::{app::AppState, problem::Problem};
use faceoff_store::{Outlook, QueuePlace};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Where something that waits, or is under way, stands among all of its sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct QueueView {
    /// From 1: the how manieth to be over, if nothing is added; smoke runs and evaluations each for themselves.
    pub place: u32,
    /// Of how many that are not over.
    pub of: u32,
    /// When it will be over, by what such work took in the last seven days; null while the queue is paused, and
    /// where something that comes before it was never measured.
    pub expected_at: Option<Timestamp>,
}

impl From<QueuePlace> for QueueView {
    fn from(place: QueuePlace) -> Self {
        Self {
            place: place.place,
            of: place.of,
            expected_at: place.expected_at,
        }
    }
}

/// Slots that play now, here and on other machines.
pub(crate) fn slots(app: &AppState) -> u32 {
    let elsewhere = app.store.workers().slots(app.config.clock.now());
    app.config.capacity.slots + elsewhere
}

/// Where everything stands that waits or is under way.
pub(crate) async fn outlook(app: &AppState) -> Result<Outlook, Problem> {
    let now = app.config.clock.now();
    Ok(app.store.outlook(slots(app), now).await?)
}
