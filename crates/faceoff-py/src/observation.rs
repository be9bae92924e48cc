//! Observations for learners: single precision, within fixed bounds. An observation has the puck's x, y, yaw and their
//! rates, 7 joint positions, 7 joint velocities, and with an opponent the x, y, z of its end effector.

use faceoff_sim::{
    channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
    model::{LINKS, TOOL},
    table::geometry::TABLE,
};
use std::{f32::consts::PI, sync::LazyLock};

/// Margin around the table for positions of puck and mallet, m. A puck that has left the table moves on until the end
/// of the control step.
const TABLE_MARGIN_M: f64 = 1.0;
/// Bounds of the puck's speed and yaw rate; a hard hit reaches a quarter of them.
const PUCK_SPEED_M_S: f32 = 20.0;
const PUCK_YAW_RATE_RAD_S: f32 = 500.0;
/// Margin beyond a joint's range, rad.
const JOINT_MARGIN_RAD: f64 = 0.2;
/// Bound of joint velocities, in multiples of their limits.
const JOINT_SPEED_FACTOR: f64 = 3.0;

/// Lowest and highest values of an observation; values beyond them are clipped. Ordinary play stays far inside.
pub static BOUNDS: LazyLock<[[f32; 2]; OBSERVATION_WITH_OPPONENT_LEN]> = LazyLock::new(|| {
    let both = |limit: f32| [-limit, limit];
    let x = [-1.0, 1.0].map(|side| {
        let half = TABLE.half_length_m() + TABLE_MARGIN_M;
        (TABLE.base_x_m + side * half) as f32
    });
    let y = both((TABLE.half_width_m() + TABLE_MARGIN_M) as f32);
    let z = [0.0, (2.0 * TOOL.end_effector_z_m + TABLE_MARGIN_M) as f32];
    let speed = both(PUCK_SPEED_M_S);
    let mut bounds = [both(0.0); OBSERVATION_WITH_OPPONENT_LEN];
    bounds[..6].copy_from_slice(&[x, y, both(PI), speed, speed, both(PUCK_YAW_RATE_RAD_S)]);
    for (joint, link) in LINKS.iter().enumerate() {
        bounds[6 + joint] = both((link.range_rad + JOINT_MARGIN_RAD) as f32);
        bounds[13 + joint] = both((JOINT_SPEED_FACTOR * link.velocity_limit_rad_s) as f32);
    }
    bounds[20..].copy_from_slice(&[x, y, z]);
    bounds
});

/// Writes an observation in single precision, within [`BOUNDS`].
pub fn write(observation: &[f64], out: &mut [f32]) {
    for ((value, [low, high]), out) in observation.iter().zip(BOUNDS.iter()).zip(out) {
        *out = (*value as f32).clamp(*low, *high);
    }
}
