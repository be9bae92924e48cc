//! Inverse kinematics in closed form. The *posture* of a point is the one pose (joint angles) that reaches it with the arm in
//! a vertical plane and the elbow up. The arm in that plane is a chain of upper arm, forearm and hand (from joint 6 to the end
//! effector). The variables `upper`, `forearm` and `hand` are their angles from straight up.

use super::constants::{
    Arm, FOREARM_M, HAND_M, HAND_PER_REACH_RAD_M, SHOULDER_M, START_HAND_RAD, UPPER_ARM_M,
};
use faceoff_sim::JOINTS;
use std::f64::consts::PI;

/// Joint positions, rad, that put the end effector at a point, m, or the nearest posture.
pub fn posture(arm: &Arm, [x, y, z]: [f64; 3]) -> [f64; JOINTS] {
    let reach = libm::hypot(x, y);
    let hand = START_HAND_RAD - HAND_PER_REACH_RAD_M * (reach - arm.start_reach_m);
    let (sin_hand, cos_hand) = libm::sincos(hand);
    // The wrist from the shoulder, horizontally and vertically.
    let ahead = reach - HAND_M * sin_hand;
    let above = z - HAND_M * cos_hand - SHOULDER_M;
    // Shoulder, elbow and wrist are a triangle of known sides.
    let shoulder_to_wrist = libm::hypot(ahead, above);
    let elbow = triangle_angle(shoulder_to_wrist, UPPER_ARM_M, FOREARM_M);
    let upper = libm::atan2(ahead, above)
        - triangle_angle(FOREARM_M, UPPER_ARM_M, shoulder_to_wrist.max(1e-9));
    let forearm = upper + PI - elbow;
    [
        libm::atan2(y, x),
        upper,
        0.0,
        upper - forearm,
        0.0,
        hand - forearm,
        0.0,
    ]
}

/// Joint velocities, rad/s, that keep the posture on a moving point (m, m/s).
pub fn velocities(arm: &Arm, point: [f64; 3], [vx, vy, vz]: [f64; 3]) -> [f64; JOINTS] {
    let [x, y, _] = point;
    // On joint 1's axis the outward direction is undefined.
    let reach = libm::hypot(x, y).max(1e-6);
    let outwards = (x * vx + y * vy) / reach;
    let [_, upper, _, elbow, _, wrist, _] = posture(arm, point);
    let forearm = upper - elbow;
    let hand = forearm + wrist;
    let hand_rate = -HAND_PER_REACH_RAD_M * outwards;
    let (sin_hand, cos_hand) = libm::sincos(hand);
    let ahead_rate = outwards - HAND_M * cos_hand * hand_rate;
    let above_rate = vz + HAND_M * sin_hand * hand_rate;
    // A stretched arm cannot move outwards; the result is a large joint velocity.
    let sin_elbow = libm::sin(upper - forearm);
    let sin_elbow = sin_elbow.abs().max(1e-6).copysign(sin_elbow);
    let (sin_forearm, cos_forearm) = libm::sincos(forearm);
    let (sin_upper, cos_upper) = libm::sincos(upper);
    let upper_rate =
        -(sin_forearm * ahead_rate + cos_forearm * above_rate) / (UPPER_ARM_M * sin_elbow);
    let forearm_rate = (cos_upper * above_rate + sin_upper * ahead_rate) / (FOREARM_M * sin_elbow);
    [
        (x * vy - y * vx) / (reach * reach),
        upper_rate,
        0.0,
        upper_rate - forearm_rate,
        0.0,
        hand_rate - forearm_rate,
        0.0,
    ]
}

/// The angle between the sides a and b of a triangle; 0 or π if there is no such triangle.
fn triangle_angle(opposite: f64, a: f64, b: f64) -> f64 {
    let cosine = (a * a + b * b - opposite * opposite) / (2.0 * a * b);
    libm::acos(cosine.clamp(-1.0, 1.0))
}
