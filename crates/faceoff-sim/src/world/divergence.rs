//! Divergence: a world that would leave its bounds stops.

use super::{Divergence, Runaway, World, bounds::is_runaway};

impl World {
    /// Checks a state outside the ordinary range: records the robots at fault, and returns what is out of bounds.
    #[cold]
    pub(super) fn find_runaway(&mut self) -> Option<Runaway> {
        self.record_runaway(|_, arm| is_runaway(arm));
        let beyond = |(robot, arm)| {
            let joint = self.bounds.joint_out_of_bounds(arm)?;
            Some(Runaway::Joint { robot, joint })
        };
        let joint = self.arms.iter().enumerate().find_map(beyond);
        joint.or_else(|| {
            self.bounds
                .is_puck_out_of_bounds(&self.puck)
                .then_some(Runaway::Puck)
        })
    }

    /// Stops the world for good.
    pub(super) fn diverge(&mut self, cause: Runaway) {
        let by = self.runaway.unwrap_or_else(|| match cause {
            Runaway::Joint { robot, .. } => [0, 1].map(|a| a == robot),
            Runaway::Puck => self.pushed,
        });
        self.divergence = Some(Divergence { by, cause });
    }
}
