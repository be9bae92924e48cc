//! `faceoff sim kinematics`: computes positions, Jacobian and dynamics of poses, for comparison with other programs.
//!
//! `q` are joint positions (rad), `dq` joint velocities (rad/s), `ddq` accelerations (rad/s²), `ee` is the end effector. The arm has
//! seven *driven* joints and, at its end, a passive *universal joint* with the mallet. The *plant* is the simulated robot with all
//! of them; the controller's model has the driven joints only.

use super::constraints::Constraints;
use anyhow::{Context as _, Result, bail, ensure};
use faceoff_sim::{
    ConstraintValues, JOINTS,
    dynamics::arm::{Bodies, Kinematics, controller_torques, mass_matrix, plant_bias},
    model::DOFS,
    robot::{inverse_kinematics::with_zero_universal, universal_joint::mallet_vertical_angles},
};
use serde::{Deserialize, Serialize};
use std::io::{BufRead as _, IsTerminal as _, Read as _, Write};

/// Largest accepted angle (rad) or rate (rad/s).
const NUMBER_LIMIT: f64 = 1e4;

/// Longest line of the input, far longer than two lists of nine numbers.
const LINE_LIMIT_BYTES: u64 = 64 << 10;

/// One line of the input.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    q: Vec<f64>,
    dq: Option<Vec<f64>>,
}

/// One line of the output, in the robot's base frame. Matrices are lists of rows.
#[derive(Debug, Serialize)]
struct PoseModel {
    /// Origin of each link, m.
    links: [[f64; 3]; JOINTS],
    /// Rotation matrix of each link.
    rotations: [[f64; 9]; JOINTS],
    /// Position of the end effector, m.
    ee: [f64; 3],
    /// Linear velocity of the end effector in the first three rows, angular velocity in the others.
    jacobian: [[f64; JOINTS]; 6],
    /// Mass matrix.
    mass: [[f64; JOINTS]; JOINTS],
    /// Torques that the motion and gravity require without acceleration, N m.
    bias: [f64; JOINTS],
    /// Torques that gravity requires, N m.
    gravity: [f64; JOINTS],
    constraints: Constraints,
    plant: Plant,
}

#[derive(Debug, Serialize)]
struct Plant {
    q: [f64; DOFS],
    /// Centre of the mallet's cylinder, m.
    mallet: [f64; 3],
    /// Direction of the cylinder's axis.
    mallet_axis: [f64; 3],
    mass: [[f64; DOFS]; DOFS],
    bias: [f64; DOFS],
}

/// Reads poses from standard input and writes one line per pose to standard output.
pub fn run() -> Result<()> {
    let stdin = std::io::stdin();
    ensure!(
        !stdin.is_terminal(),
        "expected poses on standard input, as in `faceoff sim kinematics < poses.jsonl`"
    );
    let mut input = stdin.lock();
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let mut line = String::new();
    for number in 1.. {
        line.clear();
        let length = (&mut input)
            .take(LINE_LIMIT_BYTES + 1)
            .read_line(&mut line)
            .with_context(|| format!("line {number}: expected UTF-8"))? as u64;
        if length == 0 {
            break;
        }
        ensure!(
            length <= LINE_LIMIT_BYTES,
            "line {number}: expected at most {LINE_LIMIT_BYTES} bytes"
        );
        if !line.trim().is_empty() {
            let model = evaluate_line(&line).with_context(|| format!("line {number}"))?;
            serde_json::to_writer(&mut out, &model).map_err(std::io::Error::from)?;
            out.write_all(b"\n")?;
        }
    }
    out.flush().context("standard output")
}

fn evaluate_line(line: &str) -> Result<PoseModel> {
    let pose: Pose = serde_json::from_str(line)
        .context("expected a pose, as in {\"q\": [7 numbers], \"dq\": [7 numbers]}")?;
    let q = match parse_joints("q", &pose.q)? {
        Joints::Driven(driven) => {
            let ee = Kinematics::new(&with_zero_universal(&driven)).end_effector;
            let universal = mallet_vertical_angles(ee.x, ee.y, [0.0; 2]);
            let mut q = with_zero_universal(&driven);
            q[JOINTS..].copy_from_slice(&universal);
            q
        }
        Joints::All(q) => q,
    };
    let dq = pose.dq.as_deref().map(|dq| parse_joints("dq", dq));
    let dq = match dq.transpose()? {
        None => [0.0; DOFS],
        Some(Joints::Driven(driven)) => with_zero_universal(&driven),
        Some(Joints::All(dq)) => dq,
    };
    Ok(evaluate(&q, &dq))
}

/// One number per joint.
enum Joints {
    Driven([f64; JOINTS]),
    /// The driven joints and the two axes of the universal joint.
    All([f64; DOFS]),
}

fn parse_joints(field: &str, numbers: &[f64]) -> Result<Joints> {
    if let Some(number) = numbers
        .iter()
        .find(|number| number.is_nan() || number.abs() > NUMBER_LIMIT)
    {
        bail!("{field}: expected numbers within ±{NUMBER_LIMIT}, got {number}");
    }
    if let Ok(driven) = numbers.try_into() {
        Ok(Joints::Driven(driven))
    } else if let Ok(all) = numbers.try_into() {
        Ok(Joints::All(all))
    } else {
        bail!(
            "{field}: expected {JOINTS} numbers, or {DOFS} with the universal joint's, got {}",
            numbers.len()
        )
    }
}

fn evaluate(q: &[f64; DOFS], dq: &[f64; DOFS]) -> PoseModel {
    let kinematics = Kinematics::new(q);
    let ee = kinematics.end_effector.origin;
    let mut jacobian = [[0.0; JOINTS]; 6];
    for (joint, axis) in kinematics.axes.iter().take(JOINTS).enumerate() {
        let (linear, angular) = (axis.velocity_at(ee).to_array(), axis.angular.to_array());
        for row in 0..3 {
            jacobian[row][joint] = linear[row];
            jacobian[row + 3][joint] = angular[row];
        }
    }
    let bodies = Bodies::new(&kinematics);
    let controller = bodies.controller();
    let driven: [f64; JOINTS] = std::array::from_fn(|i| dq[i]);
    let zero = [0.0; JOINTS];
    let torques = |dq: &[f64; JOINTS], ddq: &[f64; JOINTS]| {
        controller_torques(&kinematics, &controller, dq, ddq)
    };
    let gravity = torques(&zero, &zero);
    let mut mass = [[0.0; JOINTS]; JOINTS];
    for joint in 0..JOINTS {
        // The torques of a unit acceleration minus gravity are one column.
        let mut unit = zero;
        unit[joint] = 1.0;
        // Without motion, so that no other torques contribute.
        let column = torques(&zero, &unit);
        for row in 0..JOINTS {
            mass[row][joint] = column[row] - gravity[row];
        }
    }
    let plant = bodies.plant(&[1.0; DOFS]);
    let lower_triangle = mass_matrix(&kinematics, &plant);
    let positions: [f64; JOINTS] = std::array::from_fn(|i| q[i]);
    let constraints = ConstraintValues::new(&positions, &driven, &kinematics);
    PoseModel {
        links: kinematics.links.map(|link| link.origin.to_array()),
        rotations: kinematics.links.map(|link| link.rotation(0)),
        ee: ee.to_array(),
        jacobian,
        mass,
        bias: torques(&driven, &zero),
        gravity,
        constraints: constraints.into(),
        plant: Plant {
            q: *q,
            mallet: kinematics.cylinder_centre().to_array(),
            mallet_axis: kinematics.mallet_axis.to_array(),
            mass: std::array::from_fn(|i| {
                std::array::from_fn(|j| lower_triangle[i.max(j)][i.min(j)])
            }),
            bias: plant_bias(&kinematics, &plant, dq),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_names_field_and_expectation() {
        for (line, expected) in [
            (
                r#"{"q": [0, 0]}"#,
                "q: expected 7 numbers, or 9 with the universal joint's, got 2",
            ),
            (
                r#"{"q": [0, 0, 0, 0, 0, 0, 20000]}"#,
                "q: expected numbers within ±10000, got 20000",
            ),
            (
                r#"{"q": [0, 0, 0, 0, 0, 0, 0], "dq": []}"#,
                "dq: expected 7 numbers",
            ),
            (r#"{"dq": [0, 0, 0, 0, 0, 0, 0]}"#, "missing field `q`"),
            (
                r#"{"q": [0, 0, 0, 0, 0, 0, 0], "v": 1}"#,
                "unknown field `v`",
            ),
            ("[", "expected a pose"),
        ] {
            let error = format!("{:#}", evaluate_line(line).unwrap_err());
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
