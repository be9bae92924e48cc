//! *Impacts*: the starts of the puck's contacts within a control step (20 substeps of 1 ms). They serve recordings only; the physics does
//! not depend on them.

use crate::{model::SUBSTEP_S, table::puck::Puck};

/// A body that the puck touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ContactBody {
    /// A rim (wall) along a long side of the table.
    LongRim,
    /// A rim beside a goal, including its rounded end, the goal post.
    ShortRim,
    /// A robot's mallet: 0 or 1.
    Mallet(u8),
}

impl ContactBody {
    const ALL: [Self; 4] = [
        Self::LongRim,
        Self::ShortRim,
        Self::Mallet(0),
        Self::Mallet(1),
    ];

    /// The body's bit in a set of bodies.
    pub(super) const fn bit(self) -> u8 {
        match self {
            Self::LongRim => 1,
            Self::ShortRim => 1 << 1,
            Self::Mallet(0) => 1 << 2,
            Self::Mallet(_) => 1 << 3,
        }
    }
}

/// The start of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Index within the control step, from 0, of the first substep at whose start the bodies overlap.
    pub substep: u8,
    pub body: ContactBody,
    /// The puck's centre at the start of that substep, m, table frame.
    pub puck: [f64; 2],
}

impl Impact {
    /// Time since the start of the control step, s.
    #[must_use]
    pub fn after_s(&self) -> f64 {
        f64::from(self.substep) * SUBSTEP_S
    }
}

/// Largest number of recorded impacts in a control step; further ones are dropped.
const CAPACITY: usize = 6;

/// The contacts of the puck that began in a control step, in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impacts {
    /// The bodies that touch the puck now, as [`ContactBody::bit`]s.
    touching: u8,
    count: usize,
    impacts: [Impact; CAPACITY],
}

impl Default for Impacts {
    fn default() -> Self {
        let unused = Impact {
            substep: 0,
            body: ContactBody::LongRim,
            puck: [0.0; 2],
        };
        Self {
            touching: 0,
            count: 0,
            impacts: [unused; CAPACITY],
        }
    }
}

impl std::ops::Deref for Impacts {
    type Target = [Impact];

    fn deref(&self) -> &[Impact] {
        &self.impacts[..self.count]
    }
}

impl Impacts {
    /// Removes the impacts of the previous control step; contacts that persist do not start again.
    pub(super) fn begin_step(&mut self) {
        self.count = 0;
    }

    /// Records that no body touches the puck.
    #[inline(always)]
    pub(super) fn clear_touching(&mut self) {
        self.touching = 0;
    }

    /// Records the bodies that touch the puck at the start of a substep, as [`ContactBody::bit`]s.
    pub(super) fn record_touching(&mut self, touching: u8, substep: usize, puck: &Puck) {
        let started = touching & !self.touching;
        self.touching = touching;
        for body in ContactBody::ALL {
            if started & body.bit() != 0 && self.count < CAPACITY {
                self.impacts[self.count] = Impact {
                    substep: u8::try_from(substep).unwrap_or(u8::MAX),
                    body,
                    puck: [puck.pose[0], puck.pose[1]],
                };
                self.count += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Plant, World, model::CONTROL_STEP_S};

    #[test]
    fn bounce_is_recorded_once_with_time_and_position() {
        // The puck moves towards the long rim, which it touches in the second control step.
        let (start_y_m, speed_m_s) = (0.44, 1.4);
        let puck = [0.2, start_y_m, 0.0, 0.0, speed_m_s, 0.0];
        let mut world = World::new(&Plant::nominal(), &[], puck);
        let mut recorded = Vec::new();
        for step in 0..10 {
            let before = world.puck().pose[1];
            // No air flow: no force on the puck.
            world.control_step(|_| [0.0; 2]);
            for impact in world.impacts().iter() {
                recorded.push((step, *impact));
                assert!(impact.puck[1] > before, "the puck moves outwards");
            }
        }
        let [(step, impact)] = recorded[..] else {
            panic!("one bounce, not {recorded:?}");
        };
        assert_eq!(impact.body, ContactBody::LongRim);
        assert!(world.puck().velocity[1] < 0.0, "the puck moves back");
        let free_path_m = crate::table::geometry::TABLE.half_width_m()
            - crate::table::geometry::PUCK.radius_m
            - start_y_m;
        let time_s = f64::from(step) * CONTROL_STEP_S + impact.after_s();
        let expected_s = free_path_m / speed_m_s;
        assert!(
            (time_s - expected_s).abs() < 0.003,
            "impact after {time_s} s, expected {expected_s} s"
        );
    }

    #[test]
    fn impacts_beyond_the_capacity_are_dropped() {
        let mut impacts = Impacts::default();
        for substep in 0..20 {
            impacts.record_touching(ContactBody::Mallet(0).bit(), substep, &Puck::default());
            impacts.clear_touching();
        }
        assert_eq!(impacts.len(), CAPACITY);
        impacts.begin_step();
        assert!(impacts.is_empty());
    }
}
