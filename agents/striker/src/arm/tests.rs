//! Tests of the arm's references: limits, postures, distribution of speeds over the joints, correction of a sagging arm.

use super::*;
use crate::redundancy::weighted_least_squares;
use crate::testing::env;

/// The joint angles at which every episode starts.
const START: [f64; JOINTS] = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0];

/// Height of the mallet that `env` demands, metres.
const HEIGHT_M: f64 = 0.1645;
/// Control period, seconds.
const DT: f64 = 0.02;

fn arm() -> Arm {
    let mut arm = Arm::new(&env());
    arm.reset(&Joints::from(START));
    arm
}

fn pose(arm: &Arm) -> crate::Pose {
    forward(&arm.q)
}

#[test]
fn references_follow_circle_at_constant_height_within_limits() {
    let mut arm = arm();
    // The circle starts at rest at (0.65, 0) and extends a third of a metre in all directions.
    let circle_at = |time: f64| {
        let growth = 0.5 - 0.5 * (std::f64::consts::PI * (time / 2.0).min(1.0)).cos();
        let phase = 2.0 * time;
        Vec2::new(
            0.65 + 0.3 * growth * (1.0 - phase.cos()),
            0.3 * growth * phase.sin(),
        )
    };
    for k in 1..400 {
        let time = DT * f64::from(k);
        let position = circle_at(time);
        let velocity = (circle_at(time + 1e-5) - position) / 1e-5;
        let reached = arm.advance(position, velocity, Posture::Ready(Side::Right));
        assert!(
            (reached.velocity - velocity).norm() < 0.02,
            "step {k}: {reached:?}"
        );
        let tip = pose(&arm).tip;
        assert!(
            (tip.z - HEIGHT_M).abs() < 1e-4,
            "height {} at step {k}",
            tip.z
        );
        assert!(
            (tip.xy() - position).norm() < 1e-3,
            "off the path at step {k}"
        );
        assert!(arm.dq.component_div(&arm.speed_max).amax() <= 1.0 + 1e-9);
        assert!(pose(&arm).elbow_z > 0.25 && pose(&arm).wrist_z > 0.25);
    }
}

#[test]
fn motions_above_speed_limits_are_slowed_on_a_straight_path() {
    let mut arm = arm();
    let start = pose(&arm).tip;
    for _ in 0..5 {
        let tip = pose(&arm).tip;
        arm.advance(
            Vec2::new(tip.x + 0.05, tip.y),
            Vec2::new(5.0, 0.0),
            Posture::Any,
        );
    }
    let tip = pose(&arm).tip;
    assert!(tip.x > start.x + 0.05 && tip.x < start.x + 0.25, "{tip:?}");
    assert!(
        tip.y.abs() < 1e-3 && (tip.z - HEIGHT_M).abs() < 1e-3,
        "{tip:?}"
    );
    assert!(arm.dq.component_div(&arm.speed_max).amax() <= 1.0 + 1e-9);
}

#[test]
fn strike_postures_place_mallet_at_target() {
    let arm = arm();
    for side in [Side::Left, Side::Right] {
        for x in [0.62, 0.8, 1.0, 1.2, 1.3] {
            for y in [-0.3, 0.0, 0.3] {
                let q = arm.strike_posture(Vec2::new(x, y), side);
                let pose = forward(&q);
                assert!(
                    (pose.tip - Vector3::new(x, y, HEIGHT_M)).norm() < 1e-6,
                    "{x} {y} {side:?}: {:?}",
                    pose.tip
                );
                assert!(pose.elbow_z > 0.3 && pose.wrist_z > 0.3);
                for i in 0..JOINTS {
                    assert!(q[i].abs() < arm.angle_max[i]);
                }
            }
        }
    }
}

#[test]
fn least_peak_beats_least_squares_at_same_tip_velocity() {
    let arm = arm();
    let pose = forward(&arm.strike_posture(Vec2::new(0.9, 0.1), Side::Right));
    let velocity = Vector3::new(1.0, -0.1, 0.0);
    let peak = |speeds: &Joints| speeds.component_div(&arm.speed_max).amax();
    let least_squares = weighted_least_squares(
        &pose.jacobian,
        &velocity,
        &arm.speed_max.component_mul(&arm.speed_max),
    );
    let even = even_speeds(&pose.jacobian, &velocity, &arm.speed_max);
    let mut strike_compliance = arm.speed_max.component_mul(&arm.speed_max);
    let least = least_peak(
        &pose.jacobian,
        &velocity,
        &arm.speed_max,
        &mut strike_compliance,
        12,
    );
    assert!((pose.jacobian * least - velocity).norm() < 1e-6);
    assert!(peak(&least) < peak(&even) && peak(&even) < peak(&least_squares));
}

#[test]
fn sagging_arm_is_corrected() {
    let mut arm = arm();
    // A plant that sags by a constant angle in two joints.
    let sag = Joints::from([0.0, 0.006, 0.0, -0.004, 0.0, 0.0, 0.0]);
    for _ in 0..150 {
        let commanded = Joints::from(arm.action()[0]);
        arm.observe(&(commanded + sag));
        let tip = pose(&arm).tip;
        arm.advance(Vec2::new(tip.x, tip.y), Vec2::zeros(), Posture::Any);
    }
    let reached = Joints::from(arm.action()[0]) + sag;
    assert!((forward(&reached).tip.z - HEIGHT_M).abs() < 1e-3);
}
