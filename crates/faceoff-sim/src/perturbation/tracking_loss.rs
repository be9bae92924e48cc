//! The perturbation `tracking_loss`: the simulated camera loses the puck for some control steps.

use crate::TrackingLossSettings;
use crate::stream::RandomStream;

/// Draws the control steps in which the puck is lost.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingLoss {
    stream: RandomStream,
    settings: TrackingLossSettings,
    /// Control steps for which the puck stays lost.
    remaining_steps: u32,
}

impl TrackingLoss {
    /// Starts with the puck tracked.
    #[must_use]
    pub fn new(settings: &TrackingLossSettings, stream: RandomStream) -> Self {
        Self {
            stream,
            settings: settings.clone(),
            remaining_steps: 0,
        }
    }

    /// Advances by a control step, and returns whether the puck is lost in it. Do not call it for an episode's first observation.
    pub fn advance(&mut self) -> bool {
        // Always two draws, so that the draws of a step do not depend on earlier ones.
        let draw = self.stream.unit();
        let [shortest, longest] = self.settings.steps;
        let steps = self.stream.integer(shortest, longest.max(shortest));
        if self.remaining_steps == 0 && draw < self.settings.probability {
            self.remaining_steps = steps;
        }
        let lost = self.remaining_steps > 0;
        self.remaining_steps = self.remaining_steps.saturating_sub(1);
        lost
    }
}
