//! Observations as learners take them: single precision, within known bounds.

use faceoff_sim::{
    channel::observation::OBSERVATION_WITH_OPPONENT_LEN,
    model::{LINKS, TOOL},
    table::geometry::TABLE,
};
use std::{f32::consts::PI, sync::LazyLock};

/// How far around the table a puck or a mallet is told of, m. A puck that has left it goes on to the end of the
/// control step.
const AROUND_TABLE_M: f64 = 1.0;
/// Of the puck, m/s and rad/s; a hard hit is a quarter of it.
const PUCK_SPEED_M_S: f32 = 20.0;
const PUCK_YAW_RATE_RAD_S: f32 = 500.0;
/// How far beyond its range a joint is told of, rad.
const BEYOND_RANGE_RAD: f64 = 0.2;
/// In velocity limits.
const JOINT_SPEED: f64 = 3.0;

/// Least and greatest values of an observation: nothing in ordinary play comes near them, and what is beyond is told as
/// at them.
pub static BOUNDS: LazyLock<[[f32; 2]; OBSERVATION_WITH_OPPONENT_LEN]> = LazyLock::new(|| {
    let both = |limit: f32| [-limit, limit];
    let x = [-1.0, 1.0].map(|side| {
        let half = TABLE.half_length_m() + AROUND_TABLE_M;
        (TABLE.base_x_m + side * half) as f32
    });
    let y = both((TABLE.half_width_m() + AROUND_TABLE_M) as f32);
    let z = [0.0, (2.0 * TOOL.end_effector_z_m + AROUND_TABLE_M) as f32];
    let speed = both(PUCK_SPEED_M_S);
    let mut bounds = [both(0.0); OBSERVATION_WITH_OPPONENT_LEN];
    bounds[..6].copy_from_slice(&[x, y, both(PI), speed, speed, both(PUCK_YAW_RATE_RAD_S)]);
    for (joint, link) in LINKS.iter().enumerate() {
        bounds[6 + joint] = both((link.range_rad + BEYOND_RANGE_RAD) as f32);
        bounds[13 + joint] = both((JOINT_SPEED * link.velocity_limit_rad_s) as f32);
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
