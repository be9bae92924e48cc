//! A simple agent, so that golden hashes cover contacts.

use faceoff_sim::{
    model::{EE_DESIRED_HEIGHT_M, JOINTS},
    robot::inverse_kinematics::inverse_kinematics,
};

/// Control steps of one stroke.
const STROKE: u32 = 40;

/// Goes behind the puck and through it, again and again. `observation` is in the robot's own frame.
pub fn strike(observation: &[f64], step: u32) -> [f64; 2 * JOINTS] {
    let q: [f64; JOINTS] = std::array::from_fn(|i| observation[6 + i]);
    let through = 0.35 * f64::from(step % STROKE) / f64::from(STROKE);
    let target = [
        (observation[0] - 0.15 + through).clamp(0.6, 1.35),
        observation[1].clamp(-0.4, 0.4),
        EE_DESIRED_HEIGHT_M,
    ];
    let next = inverse_kinematics(target, &q);
    let mut action = [0.0; 2 * JOINTS];
    for i in 0..JOINTS {
        // Half way, so that the mallet stays at its height.
        action[i] = q[i] + 0.2 * (next[i] - q[i]);
        action[JOINTS + i] = 0.2 * (next[i] - q[i]) / 0.02;
    }
    action
}
