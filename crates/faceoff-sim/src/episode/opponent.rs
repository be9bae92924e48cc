//! The opponent of `hit`: robot 2 on a fixed figure of eight (MODEL, "The opponent of hit").

use crate::{
    model::{CONTROL_STEP_S, EE_DESIRED_HEIGHT_M, INITIAL_Q, JOINTS},
    robot::inverse_kinematics::inverse_kinematics,
};
use std::f64::consts::FRAC_PI_2;

/// Angle by which the figure advances per control step, rad.
const ADVANCE: f64 = 3.0 * CONTROL_STEP_S;
/// Centre of the figure along x, its half lengths along x (times one half) and y, m, base frame.
const CENTRE_X_M: f64 = 0.65;
const HALF_X_M: f64 = 0.1;
const HALF_Y_M: f64 = 0.16;

/// Position of the opponent on its figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Opponent {
    steps: u32,
    q: [f64; JOINTS],
}

impl Default for Opponent {
    fn default() -> Self {
        Self::new()
    }
}

impl Opponent {
    /// At rest in the initial pose.
    #[must_use]
    pub fn new() -> Self {
        Self {
            steps: 0,
            q: INITIAL_Q,
        }
    }

    /// The action of the next control step: positions and velocities, each to be interpolated
    /// linearly.
    pub fn action(&mut self) -> [f64; 2 * JOINTS] {
        self.steps += 1;
        let (sin, cos) = libm::sincos(FRAC_PI_2 + ADVANCE * f64::from(self.steps));
        let target = [
            CENTRE_X_M + HALF_X_M * sin * cos,
            HALF_Y_M * cos,
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
