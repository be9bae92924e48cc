//! The state of one arm: seven driven joints, the two hinges of the *universal joint* on which the mallet hangs, and the controllers.

use super::joints::JointConstraints;
use crate::Interpolation;
use crate::{
    dynamics::arm::Kinematics,
    model::{DOFS, JOINTS, SUBSTEP_S, SUBSTEPS},
    robot::{
        controller::SetpointLimiter,
        inverse_kinematics::with_zero_universal,
        plant::Plant,
        trajectory::{Setpoint, Trajectory, interpolate},
        universal_joint::{UniversalJointController, mallet_vertical_angles},
    },
};

/// One arm with its controllers: all state that its future depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Joint positions, rad: the driven joints, then the hinges.
    pub(super) q: [f64; DOFS],
    /// Joint velocities, rad/s.
    pub(super) dq: [f64; DOFS],
    /// Low-pass filtered velocities of the driven joints, rad/s.
    pub(super) dq_filtered: [f64; JOINTS],
    /// Torques of the drives in the last substep, N m.
    pub(super) torque: [f64; JOINTS],
    /// Desired motion in the current control step.
    pub(super) trajectory: Trajectory,
    pub(super) limiter: SetpointLimiter,
    pub(super) universal_controller: UniversalJointController,
    /// Dry friction and stops.
    pub(super) constraints: JointConstraints,
    /// Position of the end effector before the last substep, m, in the robot's base frame.
    pub(super) ee_before: [f64; 3],
    /// Control steps for which the trajectory has continued since the last action.
    coasted_steps: u32,
}

/// If an action is late, the previous trajectory continues for this many control steps: 80 ms.
const COAST_STEPS: u32 = 4;

impl Arm {
    /// An arm at rest, with its mallet vertical. `joints` are the positions of the driven joints, rad.
    pub fn new(plant: &Plant, joints: &[f64; JOINTS]) -> Self {
        let mut q = with_zero_universal(joints);
        let ee = Kinematics::new(&q).end_effector;
        let universal = mallet_vertical_angles(ee.x, ee.y, [0.0; 2]);
        q[JOINTS..].copy_from_slice(&universal);
        Self {
            q,
            dq: [0.0; DOFS],
            dq_filtered: [0.0; JOINTS],
            torque: [0.0; JOINTS],
            trajectory: [Setpoint::at_rest(*joints); SUBSTEPS],
            limiter: SetpointLimiter::new(*joints),
            universal_controller: UniversalJointController::at_rest(),
            constraints: JointConstraints::new(plant),
            ee_before: ee.origin.to_array(),
            coasted_steps: 0,
        }
    }

    /// The end of the current trajectory, where the next one starts.
    fn end(&self) -> &Setpoint {
        &self.trajectory[SUBSTEPS - 1]
    }

    /// Starts a control step with an action.
    pub fn command(&mut self, interpolation: Interpolation, action: &[f64]) {
        self.trajectory = interpolate(interpolation, self.end(), action);
        self.coasted_steps = 0;
    }

    /// Are all numbers of the trajectory finite?
    pub fn is_trajectory_finite(&self) -> bool {
        self.trajectory.iter().all(|setpoint| {
            let Setpoint {
                position,
                velocity,
                acceleration,
            } = setpoint;
            let are_finite = |row: &[f64; JOINTS]| row.iter().all(|x| x.is_finite());
            are_finite(position) && are_finite(velocity) && are_finite(acceleration)
        })
    }

    /// Starts a control step that commands the last position again, at rest.
    pub fn hold(&mut self, interpolation: Interpolation) {
        let action = interpolation.hold_position(&self.end().position);
        self.command(interpolation, &action[..interpolation.len()]);
    }

    /// Starts a control step in which the last trajectory continues at constant velocity. After [`COAST_STEPS`]
    /// such steps the arm stops.
    pub fn coast(&mut self) {
        let end = *self.end();
        self.trajectory = std::array::from_fn(|k| {
            if self.coasted_steps >= COAST_STEPS {
                return Setpoint::at_rest(end.position);
            }
            let t = (k + 1) as f64 * SUBSTEP_S;
            Setpoint {
                position: std::array::from_fn(|j| end.position[j] + t * end.velocity[j]),
                velocity: end.velocity,
                acceleration: [0.0; JOINTS],
            }
        });
        self.coasted_steps = (self.coasted_steps + 1).min(COAST_STEPS);
    }
}
