//! The arm's kinematics for batches of poses, in the robot's own base frame: what `faceoff.kinematics.native` calls.
//!
//! Where a pose puts the arm is told by the simulator's own functions. The inverses are the arithmetic of the package's
//! `kinematics/plain.py`, which explains it. Python's half checks arguments and makes the arrays, all of which lie row
//! after row. Nothing here comes from the platform's mathematics: the same arguments give the same bits everywhere,
//! alone or in a batch.

mod arrays;
mod least_squares;
mod numbers;
mod pose;
mod posture;

use arrays::{Given, Made, detached, each, each_pair, rows, rows_mut, same_length};
use faceoff_sim::{
    JOINTS,
    dynamics::spatial::Vec3,
    episode::constraints::{HEIGHT_TOLERANCE_M, LINK_HEIGHT_M},
    model::{EE_DESIRED_HEIGHT_M, LIMIT_FRACTION, LINKS},
};
use numbers::{ARM, Arm, LOWEST_M, TOLERANCE_M, X_MIN_M, Y_MAX_M};
use pose::{at, elbow_and_wrist_m, jacobian};
use pyo3::{prelude::*, types::PyDict};
use std::array::from_fn;

/// Numbers of a row of constraints: end effector, elbow and wrist, joint positions, joint velocities.
const CONSTRAINTS: usize = 5 + 2 + 2 * JOINTS + 2 * JOINTS;

/// End effectors (…, 3), m, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_forward(py: Python<'_>, q: Given<'_>, mut ee: Made<'_>) -> PyResult<()> {
    each(py, &q, &mut ee, |q| at(q).end_effector.origin.lane(0))
}

/// Heights of elbow and wrist (…, 2), m, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_heights(py: Python<'_>, q: Given<'_>, mut heights: Made<'_>) -> PyResult<()> {
    each(py, &q, &mut heights, |q| elbow_and_wrist_m(&at(q)))
}

/// Derivatives of the end effector (…, 3, 7), m/rad, at poses (…, 7), rad.
#[pyfunction]
pub fn arm_jacobian(py: Python<'_>, q: Given<'_>, mut jacobians: Made<'_>) -> PyResult<()> {
    each(py, &q, &mut jacobians, |q| -> [f64; 3 * JOINTS] {
        let columns = jacobian(&at(q)).map(|column| column.lane(0));
        from_fn(|index| columns[index % JOINTS][index / JOINTS])
    })
}

/// Origins (…, 8, 3), m, and rotations (…, 8, 3, 3) of links and end effector at poses (…, 7), rad.
#[pyfunction]
pub fn arm_frames(
    py: Python<'_>,
    q: Given<'_>,
    mut origins: Made<'_>,
    mut rotations: Made<'_>,
) -> PyResult<()> {
    const FRAMES: usize = JOINTS + 1;
    let q = rows::<JOINTS>(&q)?;
    let origins = rows_mut::<_, { 3 * FRAMES }>(&mut origins)?;
    let rotations = rows_mut::<_, { 9 * FRAMES }>(&mut rotations)?;
    same_length(q.len(), origins.len())?;
    same_length(q.len(), rotations.len())?;
    detached(py, || {
        for ((q, origins), rotations) in q.iter().zip(origins).zip(rotations) {
            let kinematics = at(q);
            let frames = kinematics.links.iter().chain([&kinematics.end_effector]);
            for (i, frame) in frames.enumerate() {
                origins[3 * i..][..3].copy_from_slice(&frame.origin.lane(0));
                rotations[9 * i..][..9].copy_from_slice(&frame.rotation(0));
            }
        }
    })
}

/// Poses (…, 7), rad, that put the end effector at targets (…, 3), m, and (…) whether they do within all bounds: the
/// points' own postures, or what is found from (…, 7) starts, rad.
#[pyfunction]
pub fn arm_inverse(
    py: Python<'_>,
    target: Given<'_>,
    q0: Option<Given<'_>>,
    mut q: Made<'_>,
    mut is_good: Made<'_, bool>,
) -> PyResult<()> {
    let arm = &*ARM;
    let target = rows::<3>(&target)?;
    let starts = q0.as_ref().map(rows::<JOINTS>).transpose()?;
    let (q, flags) = (
        rows_mut::<_, JOINTS>(&mut q)?,
        rows_mut::<_, 1>(&mut is_good)?,
    );
    let lengths = [
        q.len(),
        flags.len(),
        starts.map_or(target.len(), <[_]>::len),
    ];
    for length in lengths {
        same_length(target.len(), length)?;
    }
    detached(py, || {
        for (i, ((&point, q), flag)) in target.iter().zip(q).zip(flags).enumerate() {
            *q = match starts {
                None => posture::posture(arm, point),
                Some(starts) => least_squares::near(arm, Vec3::splat(point), &starts[i]),
            };
            *flag = [self::is_good(arm, q, Vec3::splat(point))];
        }
    })
}

/// Joint velocities (…, 7), rad/s, that keep the postures of targets (…, 3), m, on them as they move, (…, 3) m/s.
#[pyfunction]
pub fn arm_posture_velocities(
    py: Python<'_>,
    target: Given<'_>,
    velocity: Given<'_>,
    mut dq: Made<'_>,
) -> PyResult<()> {
    let arm = &*ARM;
    each_pair(py, (&target, &velocity), &mut dq, |&target, &velocity| {
        posture::rates(arm, target, velocity)
    })
}

/// The least joint velocities (…, 7), rad/s, that move the end effector of poses (…, 7), rad, with (…, 3) m/s.
#[pyfunction]
pub fn arm_velocities(
    py: Python<'_>,
    q: Given<'_>,
    velocity: Given<'_>,
    mut dq: Made<'_>,
) -> PyResult<()> {
    let arm = &*ARM;
    each_pair(py, (&q, &velocity), &mut dq, |q, &velocity| {
        least_squares::weighted(&jacobian(&at(q)), Vec3::splat(velocity), &arm.weight)
    })
}

/// Values of the constraints (…, 35) at poses (…, 7), rad, and velocities (…, 7), rad/s, in the order and with the units
/// of `faceoff.kinematics.Constraints`.
#[pyfunction]
pub fn arm_constraints(
    py: Python<'_>,
    q: Given<'_>,
    dq: Given<'_>,
    mut values: Made<'_>,
) -> PyResult<()> {
    each_pair(py, (&q, &dq), &mut values, constraints)
}

/// The numbers that `kinematics/plain.py` has, too, by its names: a test compares them.
#[pyfunction]
pub fn arm_numbers(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let told = PyDict::new(py);
    for (name, value) in [
        ("JOINT_MARGIN_RAD", numbers::JOINT_MARGIN_RAD),
        ("HEIGHT_MARGIN_M", numbers::HEIGHT_MARGIN_M),
        ("TOLERANCE_M", TOLERANCE_M),
        ("GOAL_M", numbers::GOAL_M),
        ("STEP_LIMIT_RAD", numbers::STEP_LIMIT_RAD),
        ("DAMPING", numbers::DAMPING),
        ("HAND_PER_REACH_RAD_M", numbers::HAND_PER_REACH_RAD_M),
        ("START_HAND_RAD", numbers::START_HAND_RAD),
        ("SHOULDER_M", numbers::SHOULDER_M),
        ("UPPER_ARM_M", numbers::UPPER_ARM_M),
        ("FOREARM_M", numbers::FOREARM_M),
        ("HAND_M", numbers::HAND_M),
        ("X_MIN_M", X_MIN_M),
        ("Y_MAX_M", Y_MAX_M),
    ] {
        told.set_item(name, value)?;
    }
    told.set_item("ITERATIONS", numbers::ITERATIONS)?;
    told.set_item("JOINT_BOUND_RAD", ARM.bound_rad)?;
    told.set_item("WEIGHT", ARM.weight)?;
    Ok(told)
}

/// Whether a pose, rad, has the end effector at a point, m, within all bounds.
fn is_good(arm: &Arm, q: &[f64; JOINTS], point: Vec3<f64>) -> bool {
    let kinematics = at(q);
    let error = point - kinematics.end_effector.origin;
    let [elbow, wrist] = elbow_and_wrist_m(&kinematics);
    error.dot(error) <= TOLERANCE_M * TOLERANCE_M
        && elbow.min(wrist) >= LOWEST_M - 1e-9
        && q.iter()
            .zip(arm.bound_rad)
            .all(|(angle, bound)| angle.abs() <= bound)
}

fn constraints(q: &[f64; JOINTS], dq: &[f64; JOINTS]) -> [f64; CONSTRAINTS] {
    let kinematics = at(q);
    let [x, y, z] = kinematics.end_effector.origin.lane(0);
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
