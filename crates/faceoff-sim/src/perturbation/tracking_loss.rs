//! Loss of the puck's tracking.

use crate::stream::Stream;
use faceoff_types::TrackingLossSettings;

/// Draws the control steps at which the puck is lost.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingLoss {
    stream: Stream,
    settings: TrackingLossSettings,
    remaining: u32,
}

impl TrackingLoss {
    /// Starts with the puck tracked.
    #[must_use]
    pub fn new(settings: &TrackingLossSettings, stream: Stream) -> Self {
        Self {
            stream,
            settings: settings.clone(),
            remaining: 0,
        }
    }

    /// Whether the puck is lost at the next control step. Do not call it for an episode's first observation.
    pub fn advance(&mut self) -> bool {
        // Always two draws, so that the draws of a step do not depend on earlier ones.
        let chance = self.stream.unit();
        let [shortest, longest] = self.settings.steps;
        let steps = self.stream.integer(shortest, longest.max(shortest));
        if self.remaining == 0 && chance < self.settings.probability {
            self.remaining = steps;
        }
        let lost = self.remaining > 0;
        self.remaining = self.remaining.saturating_sub(1);
        lost
    }
}
