use super::*;
use crate::testing::env;

/// The joint angles at which every episode starts.
const START: [f64; JOINTS] = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0];

fn arm() -> Arm {
    let mut arm = Arm::new(&env());
    arm.reset(&Joints::from(START));
    arm
}

#[test]
fn references_follow_a_circle_at_constant_height_within_the_speed_limits() {
    let mut arm = arm();
    let dt = 0.02;
    for k in 0..400 {
        let phase = 0.04 * f64::from(k);
        // Starts at rest at (0.65, 0) and reaches a third of a metre to all sides.
        let growth = (f64::from(k) / 100.0).min(1.0);
        let at = |phase: f64| {
            Vec2::new(
                0.65 + 0.3 * growth * (1.0 - phase.cos()),
                0.3 * growth * phase.sin(),
            )
        };
        let position = at(phase);
        let velocity = (at(phase + 1e-4) - position) / 1e-4 * (0.04 / dt);
        let share = arm.advance(position, velocity, Posture::Ready(Side::Right));
        assert!((share - 1.0).abs() < 1e-9, "step {k} was cut to {share}");
        let tip = arm.pose().tip;
        assert!(
            (tip.z - 0.1645).abs() < 1e-4,
            "height {} at step {k}",
            tip.z
        );
        assert!(
            (tip.xy() - position).norm() < 1e-3,
            "off the way at step {k}"
        );
        assert!(arm.dq.component_div(&arm.speed_max).amax() <= 1.0 + 1e-9);
        assert!(arm.pose().elbow_z > 0.25 && arm.pose().wrist_z > 0.25);
    }
}

#[test]
fn motions_beyond_the_speed_limits_are_slowed_down_not_bent() {
    let mut arm = arm();
    let start = arm.pose().tip;
    let share = arm.advance(
        Vec2::new(start.x + 0.1, start.y),
        Vec2::new(5.0, 0.0),
        Posture::Free,
    );
    assert!(share < 0.5);
    let tip = arm.pose().tip;
    assert!((tip.x - start.x - 0.1 * share).abs() < 1e-3);
    assert!(tip.y.abs() < 1e-4 && (tip.z - 0.1645).abs() < 1e-3);
    assert!(arm.dq.component_div(&arm.speed_max).amax() <= 1.0 + 1e-9);
}

#[test]
fn strike_postures_hold_the_mallet_where_they_should() {
    let arm = arm();
    for side in [Side::Left, Side::Right] {
        for x in [0.62, 0.8, 1.0, 1.2, 1.3] {
            for y in [-0.3, 0.0, 0.3] {
                let q = arm.strike_posture(Vec2::new(x, y), side);
                let pose = forward(&q);
                assert!(
                    (pose.tip - Vector3::new(x, y, 0.1645)).norm() < 1e-6,
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
fn the_least_peak_beats_least_squares_and_moves_the_tip_as_asked() {
    let arm = arm();
    let pose = forward(&arm.strike_posture(Vec2::new(0.9, 0.1), Side::Right));
    let velocity = Vector3::new(1.0, -0.1, 0.0);
    let peak = |speeds: &Joints| speeds.component_div(&arm.speed_max).amax();
    let square = weighted(
        &pose.jacobian,
        &velocity,
        &arm.speed_max.component_mul(&arm.speed_max),
    );
    let even = even_speeds(&pose.jacobian, &velocity, &arm.speed_max);
    let least = least_peak(&pose.jacobian, &velocity, &arm.speed_max);
    assert!((pose.jacobian * least - velocity).norm() < 1e-6);
    assert!(peak(&least) < peak(&even) && peak(&even) < peak(&square));
}

#[test]
fn a_hanging_arm_is_corrected() {
    let mut arm = arm();
    // A plant that hangs by a constant angle in two joints.
    let sag = Joints::from([0.0, 0.006, 0.0, -0.004, 0.0, 0.0, 0.0]);
    for _ in 0..150 {
        let commanded = Joints::from(arm.action()[0]);
        arm.observe(&(commanded + sag));
        let tip = arm.pose().tip;
        arm.advance(Vec2::new(tip.x, tip.y), Vec2::zeros(), Posture::Free);
    }
    let reached = Joints::from(arm.action()[0]) + sag;
    assert!((forward(&reached).tip.z - 0.1645).abs() < 1e-3);
}
