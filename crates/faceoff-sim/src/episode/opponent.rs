//! The opponent in the task `hit`: robot 2, whose end effector follows a fixed figure of eight, as in the simulator of the 2023 Robot Air
//! Hockey Challenge.

use crate::{
    model::{CONTROL_STEP_S, EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS},
    robot::inverse_kinematics::inverse_kinematics,
};
use std::f64::consts::FRAC_PI_2;

/// Increase of the figure's phase per control step, rad: 3 rad/s.
const PHASE_PER_STEP_RAD: f64 = 3.0 * CONTROL_STEP_S;
/// Centre of the figure along x, m, in robot 2's base frame; along y it is 0.
const CENTRE_X_M: f64 = 0.65;
/// Amplitude of the figure along x, times sine · cosine of the phase, m.
const AMPLITUDE_X_M: f64 = 0.1;
/// Amplitude of the figure along y, times cosine of the phase, m.
const AMPLITUDE_Y_M: f64 = 0.16;

/// The opponent, with its position on the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Opponent {
    /// Control steps so far.
    steps: u32,
    /// Joint positions of the last action, rad.
    q: [f64; JOINTS],
}

impl Default for Opponent {
    fn default() -> Self {
        Self::new()
    }
}

impl Opponent {
    /// The opponent at the start of an episode, at rest in the initial pose.
    #[must_use]
    pub fn new() -> Self {
        Self {
            steps: 0,
            q: INITIAL_Q,
        }
    }

    /// The action of the next control step: joint positions (rad) and velocities (rad/s), each to be interpolated
    /// linearly.
    pub fn action(&mut self) -> [f64; 2 * JOINTS] {
        self.steps += 1;
        let (sin, cos) = libm::sincos(FRAC_PI_2 + PHASE_PER_STEP_RAD * f64::from(self.steps));
        let target = [
            CENTRE_X_M + AMPLITUDE_X_M * sin * cos,
            AMPLITUDE_Y_M * cos,
            EE_DESIRED_HEIGHT_M,
        ];
        let next = inverse_kinematics(target, &self.q);
        let mut action = [0.0; 2 * JOINTS];
        for i in 0..JOINTS {
            action[i] = next[i];
            action[JOINTS + i] = (next[i] - self.q[i]) / CONTROL_STEP_S;
        }
        self.q = next;
        action
    }
}
