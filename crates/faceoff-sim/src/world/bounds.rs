//! Bounds of the simulation. In a state beyond them a substep of a millisecond is too long, and numbers grow without limit or
//! become NaN. A world that would leave them *diverges*: it stops.

use super::{arm::Arm, arm_lanes::MotionLanes};
use crate::{
    AirHockeyRuleset,
    dynamics::lanes::Lanes,
    model::{DOFS, HINGE_RANGE_RAD, JOINTS, LINKS},
    table::puck::Puck,
};
use std::{f64::consts::FRAC_PI_2, fmt};

/// The bounds of the simulation, far beyond ordinary motion of robot and puck. A world that would leave them stops
/// in its last state within them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// How far a joint may be beyond its stop (the end of its range), rad.
    pub beyond_stop_rad: f64,
    /// How fast a joint may turn, rad/s.
    pub joint_rad_s: f64,
    /// How fast the puck may move along x and y, m/s.
    pub puck_m_s: f64,
    /// How fast the puck may turn, rad/s.
    pub puck_rad_s: f64,
}

/// A joint *runs away* if it turns this many times faster than its velocity limit: no feasible command has that effect. The
/// first robot with such a joint is at fault for a later divergence.
const RUNAWAY_FACTOR: f64 = 10.0;

impl Bounds {
    /// Half a turn beyond a stop; in a millisecond a radian (joint), and ten metres or 1000 radians (puck).
    pub const WIDE: Self = Self {
        beyond_stop_rad: std::f64::consts::PI,
        joint_rad_s: 1e3,
        puck_m_s: 1e4,
        puck_rad_s: 1e6,
    };

    /// Bounds that every finite state keeps.
    pub const FINITE: Self = Self {
        beyond_stop_rad: f64::MAX,
        joint_rad_s: f64::MAX,
        puck_m_s: f64::MAX,
        puck_rad_s: f64::MAX,
    };

    /// The bounds of a ruleset.
    #[must_use]
    pub const fn of(ruleset: AirHockeyRuleset) -> Self {
        match ruleset {
            AirHockeyRuleset::First => Self::FINITE,
            AirHockeyRuleset::Second | AirHockeyRuleset::Third => Self::WIDE,
        }
    }

    /// The joint of an arm that is out of bounds or NaN.
    pub(super) fn joint_out_of_bounds(&self, arm: &Arm) -> Option<usize> {
        (0..DOFS).find(|&i| {
            let range = LINKS.get(i).map_or(HINGE_RANGE_RAD, |link| link.range_rad);
            let inside = arm.dq[i].abs() <= self.joint_rad_s
                && arm.q[i].abs() - range <= self.beyond_stop_rad;
            !inside
        })
    }

    /// Is the puck out of bounds or NaN?
    pub(super) fn is_puck_out_of_bounds(&self, puck: &Puck) -> bool {
        let [vx, vy, yaw_rate] = puck.velocity;
        let inside = vx.abs() <= self.puck_m_s
            && vy.abs() <= self.puck_m_s
            && yaw_rate.abs() <= self.puck_rad_s
            && puck.pose.iter().all(|x| x.is_finite());
        !inside
    }
}

/// Are the arms in their ordinary range of motion, which is far within all bounds? This is the only check in every substep; the others
/// follow if it fails. Beyond the driven joints, the limits are those of the mallet's hinges.
#[inline(always)]
pub(super) fn is_ordinary<T: Lanes>(motion: &MotionLanes<T>) -> T::Mask {
    let limits = |i: usize| match LINKS.get(i) {
        Some(link) => (
            RUNAWAY_FACTOR * link.velocity_limit_rad_s,
            link.range_rad + FRAC_PI_2,
        ),
        None => (Bounds::WIDE.joint_rad_s, 2.0 * FRAC_PI_2),
    };
    let joint = |i: usize| {
        let (fastest, farthest) = limits(i);
        T::mask_and(
            motion.dq[i].abs().less_or_equal(T::splat(fastest)),
            motion.q[i].abs().less_or_equal(T::splat(farthest)),
        )
    };
    let mut ordinary = joint(0);
    for i in 1..DOFS {
        ordinary = T::mask_and(ordinary, joint(i));
    }
    ordinary
}

/// Is the puck in its ordinary range of motion? In tasks and games a puck faster than 100 m/s counts as lost.
#[inline(always)]
pub(super) fn is_ordinary_puck(puck: &Puck) -> bool {
    let [vx, vy, yaw_rate] = puck.velocity;
    vx.abs() <= 100.0 && vy.abs() <= 100.0 && yaw_rate.abs() <= 1e4 // m/s, rad/s
}

/// Does a driven joint turn faster than any feasible command demands?
pub(super) fn is_runaway(arm: &Arm) -> bool {
    (0..JOINTS).any(|i| {
        let ordinary = arm.dq[i].abs() <= RUNAWAY_FACTOR * LINKS[i].velocity_limit_rad_s;
        !ordinary
    })
}

/// A world that would have left its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Divergence {
    /// Which robots are at fault (robot 0, robot 1): those whose joints or commands first ran away; without any, the robot whose joint
    /// left its bounds or, for the puck, the robots of the latest contact.
    pub robots_at_fault: [bool; 2],
    /// What would have left the bounds: a joint or the puck.
    pub cause: DivergenceCause,
}

/// The part of a world that would have left the bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DivergenceCause {
    /// A joint of a robot. Joints 0 to 6 are driven, 7 and 8 are the hinges of the mallet.
    Joint {
        /// 0 or 1.
        robot: usize,
        /// Index of the joint, 0 to 8.
        joint: usize,
    },
    Puck,
}

impl fmt::Display for DivergenceCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Bounds {
            joint_rad_s,
            puck_m_s,
            ..
        } = Bounds::WIDE;
        match self {
            Self::Joint { joint, .. } if *joint < JOINTS => write!(
                f,
                "joint {} came to turn faster than {joint_rad_s} rad/s, or half a turn beyond its stop",
                joint + 1
            ),
            Self::Joint { .. } => write!(
                f,
                "the mallet's universal joint came to turn faster than {joint_rad_s} rad/s, or half a \
                 turn beyond its stop"
            ),
            Self::Puck => write!(f, "the puck came to move faster than {puck_m_s} m/s"),
        }
    }
}
