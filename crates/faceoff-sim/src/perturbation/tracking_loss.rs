//! Losing sight of the puck.

use crate::stream::Stream;
use faceoff_types::TrackingLossSettings;

/// Decides at which control steps the puck is not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingLoss {
    stream: Stream,
    settings: TrackingLossSettings,
    remaining: u32,
}

impl TrackingLoss {
    /// Tracked at first.
    #[must_use]
    pub fn new(settings: &TrackingLossSettings, stream: Stream) -> Self {
        Self {
            stream,
            settings: settings.clone(),
            remaining: 0,
        }
    }

    /// Whether the puck is lost at the next control step. Not to be asked for an episode's first
    /// observation.
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
