//! Properties of the arm in the notations of the export formats: rotations as quaternions, angles or matrices, positions as vectors.

use super::numbers::tidy;
use crate::{
    dynamics::arm::Kinematics,
    model::{JOINTS, LINKS, Mount, Offset, TOOL},
    robot::{inverse_kinematics::with_zero_universal, universal_joint::mallet_vertical_angles},
};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

/// Which model of the arm is exported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExportedModel {
    /// The simulated arm: seven driven joints, the two of the universal joint, the mallet.
    #[default]
    Plant,
    /// The model that the controller computes with: seven joints and the end effector, no mallet.
    Controller,
}

/// Quaternion (w, x, y, z) of a mount, the fixed rotation between a link and its parent.
pub(super) fn quaternion(mount: Mount) -> [f64; 4] {
    const ROOT_HALF: f64 = FRAC_1_SQRT_2;
    match mount {
        Mount::Aligned => [1.0, 0.0, 0.0, 0.0],
        Mount::HalfTurnYz => [0.0, 0.0, ROOT_HALF, ROOT_HALF],
        Mount::QuarterTurnX => [ROOT_HALF, ROOT_HALF, 0.0, 0.0],
    }
}

/// Roll, pitch and yaw of a mount, rad.
pub(super) fn roll_pitch_yaw(mount: Mount) -> [f64; 3] {
    match mount {
        Mount::Aligned => [0.0; 3],
        Mount::HalfTurnYz => [FRAC_PI_2, 0.0, PI],
        Mount::QuarterTurnX => [FRAC_PI_2, 0.0, 0.0],
    }
}

/// Rows of a mount's rotation matrix.
pub(super) fn rotation(mount: Mount) -> [[f64; 3]; 3] {
    match mount {
        Mount::Aligned => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        Mount::HalfTurnYz => [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
        Mount::QuarterTurnX => [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
    }
}

/// An offset as a vector in the parent's frame, m.
pub(super) fn vector(offset: Offset) -> [f64; 3] {
    match offset {
        Offset::Y(y) => [0.0, y, 0.0],
        Offset::Z(z) => [0.0, 0.0, z],
    }
}

/// Position of the next joint, or of the end effector after the last link, in the frame of link `i` (0…6), m.
pub(super) fn end_of_link(i: usize) -> [f64; 3] {
    match LINKS.get(i + 1) {
        Some(next) => vector(next.offset),
        None => [0.0, 0.0, TOOL.end_effector_z_m],
    }
}

/// Radius with which link `i` (0…6) is displayed, m. The last link ends in a rod.
pub(super) fn visual_radius_m(i: usize) -> f64 {
    const RADII_M: [f64; JOINTS] = [0.075, 0.07, 0.065, 0.06, 0.055, 0.05, 0.015];
    RADII_M[i]
}

/// Angles of the universal joint (the two hinges of the mallet), rad, at which the mallet is vertical.
pub(super) fn level_mallet_angles(q: &[f64; JOINTS]) -> [f64; 2] {
    let ee = Kinematics::new(&with_zero_universal(q)).end_effector;
    mallet_vertical_angles(ee.x, ee.y, [0.0; 2]).map(tidy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mount_notations_agree_with_the_dynamics() {
        let frames = Kinematics::new(&[0.0; 9]).links;
        let mut parent = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for (link, frame) in LINKS.iter().zip(frames) {
            let mount = rotation(link.mount);
            parent = times(parent, mount);
            assert_eq!(parent.concat(), frame.rotation(0));
            let assert_near_mount = |other: [[f64; 3]; 3]| {
                let pairs = other.concat().into_iter().zip(mount.concat());
                assert!(
                    pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-15),
                    "{other:?}"
                );
            };
            assert_near_mount(of_quaternion(quaternion(link.mount)));
            assert_near_mount(of_roll_pitch_yaw(roll_pitch_yaw(link.mount)));
        }
    }

    /// Product of two matrices.
    fn times(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
    }

    /// Rotation matrix of a unit quaternion (w, x, y, z).
    fn of_quaternion([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ]
    }

    /// Rotation matrix of roll, pitch and yaw, rad: rotations about the fixed x, y and z axes, in this order.
    fn of_roll_pitch_yaw([r, p, y]: [f64; 3]) -> [[f64; 3]; 3] {
        let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(r), libm::sincos(p), libm::sincos(y));
        let roll = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
        let pitch = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
        let yaw = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
        times(yaw, times(pitch, roll))
    }
}
