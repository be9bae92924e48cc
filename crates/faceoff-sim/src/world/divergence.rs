//! *Divergence*: a world whose state would leave the bounds of the simulation stops.

use super::{Divergence, DivergenceCause, World, bounds::is_runaway};

impl World {
    /// Checks a state outside the ordinary range: records the robots whose joints turn too fast, and returns the part of the world that is
    /// out of bounds, if any.
    #[cold]
    pub(super) fn find_divergence_cause(&mut self) -> Option<DivergenceCause> {
        self.record_runaway(|_, arm| is_runaway(arm));
        let joint_out_of_bounds = |(robot, arm)| {
            let joint = self.bounds.joint_out_of_bounds(arm)?;
            Some(DivergenceCause::Joint { robot, joint })
        };
        let joint = self.arms.iter().enumerate().find_map(joint_out_of_bounds);
        joint.or_else(|| {
            self.bounds
                .is_puck_out_of_bounds(&self.puck)
                .then_some(DivergenceCause::Puck)
        })
    }

    /// Stops the world for good. At fault are the robots that first ran away; without any, the robot whose joint is out of bounds, or the
    /// robots that last had contact.
    pub(super) fn diverge(&mut self, cause: DivergenceCause) {
        let robots_at_fault = self.runaway_robots.unwrap_or_else(|| match cause {
            DivergenceCause::Joint { robot, .. } => [0, 1].map(|index| index == robot),
            DivergenceCause::Puck => self.last_contact_robots,
        });
        self.divergence = Some(Divergence {
            robots_at_fault,
            cause,
        });
    }
}
