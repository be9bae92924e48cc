//! Kinematics and dynamics of the controller's model (seven joints, no mallet) match the recording `kinematics` of the *reference*, the
//! challenge's own simulator. Matrices are row-major; the Jacobian has rows for the end effector's linear (m/s) and angular (rad/s)
//! velocity.

use crate::reference::{array, flat, max_difference, recording};
use faceoff_sim::{
    JOINTS,
    dynamics::arm::{Bodies, Kinematics, controller_torques},
    robot::inverse_kinematics::with_zero_universal,
};

#[test]
fn positions_rotations_and_jacobian_match() {
    for case in recording("kinematics")["fk"].as_array().unwrap() {
        let kinematics = Kinematics::new(&with_zero_universal(&array(&case["q"])));
        let (link_4, link_7, ee) = (
            &kinematics.links[3],
            &kinematics.links[6],
            &kinematics.end_effector,
        );
        for (key, frame) in [("4", link_4), ("7", link_7), ("ee", ee)] {
            let position = flat(&case[format!("pos_{key}")]);
            let rotation = flat(&case[format!("rot_{key}")]);
            assert!(max_difference(&position, &frame.origin.to_array()) < 1e-6);
            assert!(max_difference(&rotation, &frame.rotation(0)) < 1e-6);
        }
        let mut jacobian = [0.0; 6 * JOINTS];
        for joint in 0..JOINTS {
            let linear = kinematics.axes[joint].velocity_at(ee.origin).to_array();
            let angular = kinematics.axes[joint].angular.to_array();
            for row in 0..3 {
                jacobian[JOINTS * row + joint] = linear[row];
                jacobian[JOINTS * (row + 3) + joint] = angular[row];
            }
        }
        assert!(max_difference(&flat(&case["jac_ee"]), &jacobian) < 1e-6);
    }
}

#[test]
fn mass_matrix_bias_and_gravity_match() {
    for case in recording("kinematics")["dyn"].as_array().unwrap() {
        let kinematics = Kinematics::new(&with_zero_universal(&array(&case["q"])));
        let bodies = Bodies::new(&kinematics).controller();
        let dq: [f64; JOINTS] = array(&case["dq"]);
        let zero = [0.0; JOINTS];
        let bias = controller_torques(&kinematics, &bodies, &dq, &zero);
        let gravity = controller_torques(&kinematics, &bodies, &zero, &zero);
        assert!(max_difference(&flat(&case["bias"]), &bias) < 1e-5);
        assert!(max_difference(&flat(&case["gravity"]), &gravity) < 1e-5);
        // Column by column: the torque of a unit acceleration, less gravity.
        let mut mass = [0.0; JOINTS * JOINTS];
        for joint in 0..JOINTS {
            let mut ddq = zero;
            ddq[joint] = 1.0;
            let torque = controller_torques(&kinematics, &bodies, &zero, &ddq);
            for row in 0..JOINTS {
                mass[JOINTS * row + joint] = torque[row] - gravity[row];
            }
        }
        assert!(max_difference(&flat(&case["M"]), &mass) < 1e-5);
    }
}
