//! The arm's kinematics for batches of poses, in the robot's base frame, for `faceoff.kinematics.native`.
//!
//! Forward kinematics are the simulator's functions. The inverses are those of the package's `kinematics/plain.py`
//! (Python without NumPy), which explains them. The Python half checks arguments and allocates the arrays, all of them contiguous. The
//! platform's mathematics are not used: the same arguments give the same bits on every machine, alone or in a batch.

mod arrays;
mod constants;
mod least_squares;
mod pose;
mod posture;

use arrays::{
    Input, Output, check_same_length, map_row_pairs, map_rows, rows, rows_mut, without_gil,
};
use constants::{ARM, Arm, LOWEST_M, SOLUTION_TOLERANCE_M, X_MIN_M, Y_MAX_M};
use faceoff_sim::{
    JOINTS,
    dynamics::spatial::Vec3,
    episode::constraints::{HEIGHT_TOLERANCE_M, LINK_HEIGHT_M},
    model::{EE_DESIRED_HEIGHT_M, LIMIT_FRACTION, LINKS},
};
use pose::{elbow_and_wrist_m, jacobian, kinematics_at};
use pyo3::{prelude::*, types::PyDict};
use std::array::from_fn;

/// Count of values in a row of constraints: end effector, elbow and wrist, joint positions, joint velocities.
const CONSTRAINTS: usize = 5 + 2 + 2 * JOINTS + 2 * JOINTS;

/// End effectors (…, 3), m, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_forward(py: Python<'_>, q: Input<'_>, mut ee: Output<'_>) -> PyResult<()> {
    map_rows(py, &q, &mut ee, |q| {
        kinematics_at(q).end_effector.origin.to_array()
    })
}

/// Heights of elbow and wrist (…, 2), m, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_heights(py: Python<'_>, q: Input<'_>, mut heights: Output<'_>) -> PyResult<()> {
    map_rows(py, &q, &mut heights, |q| {
        elbow_and_wrist_m(&kinematics_at(q))
    })
}

/// Derivatives of the end effector (…, 3, 7), m/rad, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_jacobian(py: Python<'_>, q: Input<'_>, mut jacobians: Output<'_>) -> PyResult<()> {
    map_rows(py, &q, &mut jacobians, |q| -> [f64; 3 * JOINTS] {
        let columns = jacobian(&kinematics_at(q)).map(|column| column.to_array());
        from_fn(|index| columns[index % JOINTS][index / JOINTS])
    })
}

/// Origins (…, 8, 3), m, and rotations (…, 8, 3, 3) of links and end effector at poses (…, 7), rad.
#[pyfunction]
pub fn arm_frames(
    py: Python<'_>,
    q: Input<'_>,
    mut origins: Output<'_>,
    mut rotations: Output<'_>,
) -> PyResult<()> {
    const FRAMES: usize = JOINTS + 1;
    let q = rows::<JOINTS>(&q)?;
    let origins = rows_mut::<_, { 3 * FRAMES }>(&mut origins)?;
    let rotations = rows_mut::<_, { 9 * FRAMES }>(&mut rotations)?;
    check_same_length(q.len(), origins.len())?;
    check_same_length(q.len(), rotations.len())?;
    without_gil(py, || {
        for ((q, origins), rotations) in q.iter().zip(origins).zip(rotations) {
            let kinematics = kinematics_at(q);
            let frames = kinematics.links.iter().chain([&kinematics.end_effector]);
            for (i, frame) in frames.enumerate() {
                origins[3 * i..][..3].copy_from_slice(&frame.origin.to_array());
                rotations[9 * i..][..9].copy_from_slice(&frame.rotation(0));
            }
        }
    })
}

/// Poses (…, 7), rad, that put the end effector at targets (…, 3), m, and (…) whether they do so within all bounds:
/// the points' postures, or solutions near start poses (…, 7), rad.
#[pyfunction]
pub fn arm_inverse(
    py: Python<'_>,
    target: Input<'_>,
    q0: Option<Input<'_>>,
    mut q: Output<'_>,
    mut is_solved: Output<'_, bool>,
) -> PyResult<()> {
    let arm = &*ARM;
    let target = rows::<3>(&target)?;
    let starts = q0.as_ref().map(rows::<JOINTS>).transpose()?;
    let (q, flags) = (
        rows_mut::<_, JOINTS>(&mut q)?,
        rows_mut::<_, 1>(&mut is_solved)?,
    );
    let lengths = [
        q.len(),
        flags.len(),
        starts.map_or(target.len(), <[_]>::len),
    ];
    for length in lengths {
        check_same_length(target.len(), length)?;
    }
    without_gil(py, || {
        for (i, ((&point, q), flag)) in target.iter().zip(q).zip(flags).enumerate() {
            *q = match starts {
                None => posture::posture(arm, point),
                Some(starts) => least_squares::solve_near(arm, Vec3::splat(point), &starts[i]),
            };
            *flag = [self::is_solution(arm, q, Vec3::splat(point))];
        }
    })
}

/// Joint velocities (…, 7), rad/s, that keep the postures on targets (…, 3), m, moving with (…, 3) m/s.
#[pyfunction]
pub fn arm_posture_velocities(
    py: Python<'_>,
    target: Input<'_>,
    velocity: Input<'_>,
    mut dq: Output<'_>,
) -> PyResult<()> {
    let arm = &*ARM;
    map_row_pairs(py, (&target, &velocity), &mut dq, |&target, &velocity| {
        posture::velocities(arm, target, velocity)
    })
}

/// The smallest weighted joint velocities (…, 7), rad/s, that move the end effector of poses (…, 7), rad, with (…, 3)
/// m/s.
#[pyfunction]
pub fn arm_velocities(
    py: Python<'_>,
    q: Input<'_>,
    velocity: Input<'_>,
    mut dq: Output<'_>,
) -> PyResult<()> {
    let arm = &*ARM;
    map_row_pairs(py, (&q, &velocity), &mut dq, |q, &velocity| {
        least_squares::least_change(
            &jacobian(&kinematics_at(q)),
            Vec3::splat(velocity),
            &arm.weight,
        )
    })
}

/// Values of the constraints (…, 35) at poses (…, 7), rad, and velocities (…, 7), rad/s, in the order and with the units
/// of `faceoff.kinematics.Constraints`.
#[pyfunction]
pub fn arm_constraints(
    py: Python<'_>,
    q: Input<'_>,
    dq: Input<'_>,
    mut values: Output<'_>,
) -> PyResult<()> {
    map_row_pairs(py, (&q, &dq), &mut values, constraints)
}

/// The constants that `kinematics/plain.py` (Python without NumPy) has, too, under the same names; a test compares them.
#[pyfunction]
pub fn arm_constants(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in [
        ("JOINT_MARGIN_RAD", constants::JOINT_MARGIN_RAD),
        ("HEIGHT_MARGIN_M", constants::HEIGHT_MARGIN_M),
        ("SOLUTION_TOLERANCE_M", SOLUTION_TOLERANCE_M),
        (
            "CONVERGENCE_TOLERANCE_M",
            constants::CONVERGENCE_TOLERANCE_M,
        ),
        ("STEP_LIMIT_RAD", constants::STEP_LIMIT_RAD),
        ("DAMPING", constants::DAMPING),
        ("HAND_PER_REACH_RAD_M", constants::HAND_PER_REACH_RAD_M),
        ("START_HAND_RAD", constants::START_HAND_RAD),
        ("SHOULDER_M", constants::SHOULDER_M),
        ("UPPER_ARM_M", constants::UPPER_ARM_M),
        ("FOREARM_M", constants::FOREARM_M),
        ("HAND_M", constants::HAND_M),
        ("X_MIN_M", X_MIN_M),
        ("Y_MAX_M", Y_MAX_M),
    ] {
        dict.set_item(name, value)?;
    }
    dict.set_item("ITERATIONS", constants::ITERATIONS)?;
    dict.set_item("JOINT_BOUND_RAD", ARM.bound_rad)?;
    dict.set_item("WEIGHT", ARM.weight)?;
    Ok(dict)
}

/// Whether a pose, rad, puts the end effector at a point, m, within all bounds.
fn is_solution(arm: &Arm, q: &[f64; JOINTS], point: Vec3<f64>) -> bool {
    let kinematics = kinematics_at(q);
    let error = point - kinematics.end_effector.origin;
    let [elbow, wrist] = elbow_and_wrist_m(&kinematics);
    error.dot(error) <= SOLUTION_TOLERANCE_M * SOLUTION_TOLERANCE_M
        && elbow.min(wrist) >= LOWEST_M - 1e-9
        && q.iter()
            .zip(arm.bound_rad)
            .all(|(angle, bound)| angle.abs() <= bound)
}

fn constraints(q: &[f64; JOINTS], dq: &[f64; JOINTS]) -> [f64; CONSTRAINTS] {
    let kinematics = kinematics_at(q);
    let [x, y, z] = kinematics.end_effector.origin.to_array();
    let low = EE_DESIRED_HEIGHT_M - HEIGHT_TOLERANCE_M;
    let high = EE_DESIRED_HEIGHT_M + HEIGHT_TOLERANCE_M;
    let mut values = [0.0; CONSTRAINTS];
    values[..5].copy_from_slice(&[X_MIN_M - x, -y - Y_MAX_M, y - Y_MAX_M, low - z, z - high]);
    values[5..7]
        .copy_from_slice(&elbow_and_wrist_m(&kinematics).map(|height| LINK_HEIGHT_M - height));
    let (positions, velocities) = values[7..].split_at_mut(2 * JOINTS);
    for joint in 0..JOINTS {
        let position = LIMIT_FRACTION * LINKS[joint].range_rad;
        let velocity = LIMIT_FRACTION * LINKS[joint].velocity_limit_rad_s;
        positions[joint] = q[joint] - position;
        positions[JOINTS + joint] = -position - q[joint];
        velocities[joint] = dq[joint] - velocity;
        velocities[JOINTS + joint] = -velocity - dq[joint];
    }
    values
}
