//! Motions of the arm in all interpolations match the recording `arm_tracking` of the *reference*, the simulator of the 2023 Robot Air
//! Hockey Challenge. `q` are joint positions (rad), `dq` velocities (rad/s), `ee` is the end effector (m).

use crate::reference::{array, flat, max_difference, recording};
use faceoff_sim::{ConstraintValues, Interpolation, Plant, SUBSTEPS, World};

/// Largest differences between a recorded and a simulated motion, in SI units.
#[derive(Debug, Default)]
struct Differences {
    q: f64,
    dq: f64,
    dq_filtered: f64,
    /// Angles of the universal joint, the two hinges on which the mallet hangs.
    universal: f64,
    ee: f64,
    /// The values that the rules' constraints limit.
    constraints: f64,
    torque: f64,
    /// Positions and velocities in each millisecond; the others, except for the torque, are compared at control steps.
    q_dq_1ms: f64,
}

#[test]
fn motions_match_recordings() {
    let recording = recording("arm_tracking");
    let init: [f64; 7] = array(&recording["init_q"]);
    for case in recording["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let interpolation = Interpolation::from_code(case["interpolation_order"].as_i64()).unwrap();
        let mut world = World::new(&Plant::nominal(), &[init], [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut d = Differences::default();
        let actions = case["actions"].as_array().unwrap();
        let mut torque_row = 0;
        for (step, action) in actions.iter().enumerate() {
            world.command(0, interpolation, &flat(action));
            for _ in 0..SUBSTEPS {
                world.substep();
                if let Some(row) = case["torque_1ms"].get(torque_row) {
                    d.torque = d.torque.max(max_difference(&flat(row), world.torques(0)));
                    let state = [world.joints(0), world.joint_velocities(0)].concat();
                    let row = flat(&case["q_dq_1ms"][torque_row]);
                    d.q_dq_1ms = d.q_dq_1ms.max(max_difference(&row, &state));
                }
                torque_row += 1;
            }
            let row = |key: &str| flat(&case[key][step + 1]);
            let kinematics = world.kinematics(0);
            let ee = kinematics.end_effector.origin.to_array();
            d.q = d.q.max(max_difference(&row("q"), &world.joints(0)));
            d.dq =
                d.dq.max(max_difference(&row("dq"), &world.joint_velocities(0)));
            d.dq_filtered = d.dq_filtered.max(max_difference(
                &row("dq_observed"),
                world.filtered_velocities(0),
            ));
            d.universal = d
                .universal
                .max(max_difference(&row("universal_joint"), &world.universal(0)));
            d.ee = d.ee.max(max_difference(&row("ee_pos_robot_frame"), &ee));
            let actual =
                ConstraintValues::new(&world.joints(0), world.filtered_velocities(0), &kinematics);
            let expected = &case["max_constraint"][step];
            let expected = [
                "joint_pos_constr",
                "joint_vel_constr",
                "ee_constr",
                "link_constr",
            ]
            .map(|key| expected[key].as_f64().unwrap());
            d.constraints = d.constraints.max(max_difference(
                &expected,
                &[actual.joint_pos, actual.joint_vel, actual.ee, actual.link],
            ));
        }
        println!("{name}: {d:?}");
        assert!(d.q <= 1e-6, "{name}: joint positions {:e} rad", d.q);
        assert!(
            d.universal <= 1e-6,
            "{name}: universal joint {:e} rad",
            d.universal
        );
        assert!(d.torque <= 1e-3, "{name}: torques {:e} N m", d.torque);
        assert!(d.ee <= 1e-6, "{name}: end effector {:e} m", d.ee);
        assert!(
            d.constraints <= 1e-5,
            "{name}: constraint values {:e}",
            d.constraints
        );
        assert!(
            d.dq_filtered <= 5e-5,
            "{name}: filtered velocity {:e} rad/s",
            d.dq_filtered
        );
    }
}
