//! When the puck came to touch what, within a control step. Nothing of the physics depends on it.

use crate::{model::SUBSTEP_S, table::puck::Puck};

/// What the puck came to touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Met {
    /// A rim along the table.
    LongRim,
    /// A rim beside a goal, or a goal post.
    ShortRim,
    /// A robot's mallet: 0 or 1.
    Mallet(u8),
}

impl Met {
    const ALL: [Self; 4] = [
        Self::LongRim,
        Self::ShortRim,
        Self::Mallet(0),
        Self::Mallet(1),
    ];

    /// Its bit among those of a substep.
    pub(super) const fn bit(self) -> u8 {
        match self {
            Self::LongRim => 1,
            Self::ShortRim => 1 << 1,
            Self::Mallet(0) => 1 << 2,
            Self::Mallet(_) => 1 << 3,
        }
    }
}

/// The beginning of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// The substep of the control step before which the bodies were found to overlap, from 0.
    pub substep: u8,
    /// What the puck touches.
    pub met: Met,
    /// The puck's centre then, m, table frame.
    pub puck: [f64; 2],
}

impl Impact {
    /// Time since the control step's beginning, s.
    #[must_use]
    pub fn after_s(&self) -> f64 {
        f64::from(self.substep) * SUBSTEP_S
    }
}

/// Contacts that begin in one control step; more than these are not noted.
const CAPACITY: usize = 6;

/// The contacts of the puck that began in a control step, in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impacts {
    /// What touches the puck, as bits.
    touching: u8,
    count: usize,
    begun: [Impact; CAPACITY],
}

impl Default for Impacts {
    fn default() -> Self {
        let nothing = Impact {
            substep: 0,
            met: Met::LongRim,
            puck: [0.0; 2],
        };
        Self {
            touching: 0,
            count: 0,
            begun: [nothing; CAPACITY],
        }
    }
}

impl std::ops::Deref for Impacts {
    type Target = [Impact];

    fn deref(&self) -> &[Impact] {
        &self.begun[..self.count]
    }
}

impl Impacts {
    /// Forgets those of the control step before; what touches the puck still does.
    pub(super) fn begin_step(&mut self) {
        self.count = 0;
    }

    /// Nothing touches the puck.
    #[inline(always)]
    pub(super) fn part(&mut self) {
        self.touching = 0;
    }

    /// Takes note of what touches the puck before a substep, as [`Met::bit`]s.
    pub(super) fn touch(&mut self, touching: u8, substep: usize, puck: &Puck) {
        let begun = touching & !self.touching;
        self.touching = touching;
        for met in Met::ALL {
            if begun & met.bit() != 0 && self.count < CAPACITY {
                self.begun[self.count] = Impact {
                    substep: u8::try_from(substep).unwrap_or(u8::MAX),
                    met,
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
    use crate::{Plant, World};

    #[test]
    fn a_bounce_is_noted_once_where_and_when_it_begins() {
        // 1.4 m/s towards the long rim, which it meets in the second control step.
        let mut world = World::new(&Plant::nominal(), &[], [0.2, 0.44, 0.0, 0.0, 1.4, 0.0]);
        let mut noted = Vec::new();
        for step in 0..10 {
            let before = world.puck().pose[1];
            world.control_step(|_| [0.0; 2]);
            for impact in world.impacts().iter() {
                noted.push((step, *impact));
                assert!(impact.puck[1] > before, "it still moves outwards");
            }
        }
        let [(step, impact)] = noted[..] else {
            panic!("one bounce, not {noted:?}");
        };
        assert_eq!(impact.met, Met::LongRim);
        assert!(world.puck().velocity[1] < 0.0, "it came back");
        let free_m = crate::table::geometry::TABLE.half_width_m()
            - crate::table::geometry::PUCK.radius_m
            - 0.44;
        let time_s = f64::from(step) * 0.02 + impact.after_s();
        let expected_s = free_m / 1.4;
        assert!(
            (time_s - expected_s).abs() < 0.003,
            "met after {time_s} s, a free way of {expected_s} s"
        );
    }

    #[test]
    fn more_than_there_is_room_for_is_not_noted() {
        let mut impacts = Impacts::default();
        for substep in 0..20 {
            impacts.touch(Met::Mallet(0).bit(), substep, &Puck::default());
            impacts.part();
        }
        assert_eq!(impacts.len(), CAPACITY);
        impacts.begin_step();
        assert!(impacts.is_empty());
    }
}
