//! How a world comes to the end of its bounds.

use super::{Divergence, Runaway, World, bounds::is_runaway};

impl World {
    /// Looks closer at a state that is not an ordinary one: who is to blame if it gets worse, and whether
    /// it is out of bounds.
    #[cold]
    pub(super) fn extraordinary(&mut self) -> Option<Runaway> {
        self.note_runaway(|_, arm| is_runaway(arm));
        let beyond = |(robot, arm)| {
            let joint = self.bounds.joint_beyond(arm)?;
            Some(Runaway::Joint { robot, joint })
        };
        let joint = self.arms.iter().enumerate().find_map(beyond);
        joint.or_else(|| self.bounds.puck_beyond(&self.puck).then_some(Runaway::Puck))
    }

    /// Stands still from now on.
    pub(super) fn diverge(&mut self, what: Runaway) {
        let by = self.runaway.unwrap_or_else(|| match what {
            Runaway::Joint { robot, .. } => [0, 1].map(|a| a == robot),
            Runaway::Puck => self.pushed,
        });
        self.divergence = Some(Divergence { by, what });
    }
}
