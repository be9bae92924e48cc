//! The state of several arms during their substeps, one arm in each *lane* (number slot) of a SIMD register.

use super::{arm::Arm, friction::FrictionLanes};
use crate::{
    dynamics::{
        lanes::{Lanes, gather, row, set_row},
        spatial::Vec3,
    },
    model::{DOFS, JOINTS},
    robot::{
        controller::SetpointLimiter,
        plant::{Plant, PlantLanes},
        universal_joint::UniversalJointController,
    },
};

/// Several arms with their controllers and plants.
#[derive(Debug)]
pub struct ArmLanes<T: Lanes> {
    pub motion: MotionLanes<T>,
    /// Torques of the drives, N m.
    pub torque: [T; JOINTS],
    pub limiter: SetpointLimiter<T>,
    pub universal_controller: UniversalJointController<T>,
    pub friction: FrictionLanes<T>,
    /// Positions of the end effectors before the substep, m, each in its robot's base frame.
    pub ee_before: Vec3<T>,
    pub plant: PlantLanes<T>,
}

/// Positions and velocities of the joints of several arms.
#[derive(Debug, Clone, Copy)]
pub struct MotionLanes<T> {
    /// Joint positions, rad.
    pub q: [T; DOFS],
    /// Joint velocities, rad/s.
    pub dq: [T; DOFS],
    /// Low-pass filtered velocities of the driven joints, rad/s.
    pub dq_filtered: [T; JOINTS],
}

impl<T: Lanes> ArmLanes<T> {
    /// Collects arms into the lanes; `source` returns the arm and the plant of a lane.
    #[inline(always)]
    pub fn gather<'a>(source: impl Fn(usize) -> (&'a Arm, &'a Plant)) -> Self {
        let arm = |lane: usize| source(lane).0;
        Self {
            motion: MotionLanes {
                q: gather(|lane| &arm(lane).q),
                dq: gather(|lane| &arm(lane).dq),
                dq_filtered: gather(|lane| &arm(lane).dq_filtered),
            },
            torque: gather(|lane| &arm(lane).torque),
            limiter: SetpointLimiter::gather(|lane| &arm(lane).limiter),
            universal_controller: UniversalJointController::gather(|lane| {
                &arm(lane).universal_controller
            }),
            friction: FrictionLanes::gather(|lane| &arm(lane).constraints),
            ee_before: {
                let [x, y, z] = gather(|lane| &arm(lane).ee_before);
                Vec3::new(x, y, z)
            },
            plant: PlantLanes::gather(|lane| source(lane).1),
        }
    }

    /// Writes one lane back to its arm.
    pub fn store(&self, lane: usize, arm: &mut Arm) {
        self.motion.store(lane, arm);
        arm.torque = row(&self.torque, lane);
        arm.limiter = self.limiter.lane(lane);
        arm.universal_controller = self.universal_controller.lane(lane);
        self.friction.store(lane, &mut arm.constraints);
        arm.ee_before = self.ee_before.lane(lane);
    }
}

impl<T: Lanes> MotionLanes<T> {
    /// Writes positions and velocities of one lane to its arm.
    pub fn store(&self, lane: usize, arm: &mut Arm) {
        arm.q = row(&self.q, lane);
        arm.dq = row(&self.dq, lane);
        arm.dq_filtered = row(&self.dq_filtered, lane);
    }

    /// Replaces one lane by the same lane of another instant.
    pub fn replace(&mut self, lane: usize, other: &Self) {
        set_row(&mut self.q, lane, &row(&other.q, lane));
        set_row(&mut self.dq, lane, &row(&other.dq, lane));
        set_row(&mut self.dq_filtered, lane, &row(&other.dq_filtered, lane));
    }
}
