//! The mallet's striking cylinder, the part that touches the puck. It leans slightly while the arm moves, since the mallet's joint follows
//! the vertical with a lag. All positions are in the table frame, whose z = 0 is the surface.
//!
//! A lean of 0.05 rad brings the cylinder's side half a millimetre closer to the puck at the height of
//! the puck's edge, as much as a glancing contact is deep.

use crate::model::TOOL;

/// A leaning cylinder in the table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MalletCylinder {
    /// m.
    pub centre: [f64; 3],
    /// Shift of the axis in x and y per metre of height.
    pub lean: [f64; 2],
}

/// Largest lean along x and along y. Beyond it the mallet lies on its side, and horizontal sections do not describe it.
const STEEPEST_LEAN: f64 = 1.0;

/// Largest reach of a horizontal section from the centre, m, for any lean: half height times √2 plus radius
/// times √3.
pub const LARGEST_REACH_M: f64 =
    1.415 * TOOL.cylinder_half_height_m + 1.733 * TOOL.cylinder_radius_m;

impl MalletCylinder {
    #[must_use]
    pub fn upright(centre: [f64; 3]) -> Self {
        Self {
            centre,
            lean: [0.0; 2],
        }
    }

    /// A cylinder with its axis along a unit vector, up or down.
    #[inline(always)]
    pub fn along(centre: [f64; 3], axis: [f64; 3]) -> Self {
        // Keeps the lean finite if the axis is horizontal.
        let up = axis[2].signum() * axis[2].abs().max(1e-3);
        let clamp = |lean: f64| lean.clamp(-STEEPEST_LEAN, STEEPEST_LEAN);
        Self {
            centre,
            lean: [clamp(axis[0] / up), clamp(axis[1] / up)],
        }
    }

    /// Heights of the lowest and the highest point of the axis, m.
    #[inline(always)]
    pub fn heights(&self) -> [f64; 2] {
        let [a, b] = self.lean;
        let half = TOOL.cylinder_half_height_m / (1.0 + a * a + b * b).sqrt();
        [self.centre[2] - half, self.centre[2] + half]
    }

    /// Position (x, y) of the axis at a height, m.
    #[inline(always)]
    pub fn axis_at(&self, z: f64) -> [f64; 2] {
        let up = z - self.centre[2];
        [
            self.centre[0] + up * self.lean[0],
            self.centre[1] + up * self.lean[1],
        ]
    }

    /// Reach of a horizontal section, an ellipse, from the axis in a direction, m. The direction need not have
    /// unit length.
    #[inline(always)]
    pub fn reach(&self, direction: [f64; 2]) -> f64 {
        let [x, y] = direction;
        let along = x * self.lean[0] + y * self.lean[1];
        let square = x * x + y * y;
        if square == 0.0 {
            return TOOL.cylinder_radius_m;
        }
        TOOL.cylinder_radius_m * (1.0 + along * along / square).sqrt()
    }

    /// The unit normal of the cylinder's side for a contact in a horizontal direction: perpendicular to the axis.
    #[inline(always)]
    pub fn side_normal(&self, horizontal: [f64; 3]) -> [f64; 3] {
        let [x, y, _] = horizontal;
        let down = x * self.lean[0] + y * self.lean[1];
        let scale = 1.0 / (x * x + y * y + down * down).sqrt();
        [x * scale, y * scale, -down * scale]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_cylinder_is_the_same_at_every_height() {
        let cylinder = MalletCylinder::along([0.1, 0.2, 0.0145], [0.0, 0.0, 1.0]);
        assert_eq!(cylinder, MalletCylinder::upright([0.1, 0.2, 0.0145]));
        assert_eq!(
            MalletCylinder::along([0.0; 3], [0.1, -0.2, 0.9]),
            MalletCylinder::along([0.0; 3], [-0.1, 0.2, -0.9])
        );
        assert_eq!(cylinder.axis_at(0.0), cylinder.axis_at(0.02));
        assert_eq!(cylinder.reach([3.0, 4.0]), TOOL.cylinder_radius_m);
        let half_height_m = TOOL.cylinder_half_height_m;
        assert_eq!(
            cylinder.heights(),
            [0.0145 - half_height_m, 0.0145 + half_height_m]
        );
    }

    #[test]
    fn leaning_cylinder_reaches_further_only_along_its_lean() {
        let (sin, cos) = libm::sincos(0.05); // the axis leans by 0.05 rad along x
        let cylinder = MalletCylinder::along([0.0, 0.0, 0.01], [sin, 0.0, cos]);
        let [x, y] = cylinder.axis_at(0.02); // 0.01 m above the centre
        assert!((x - 0.01 * sin / cos).abs() < 1e-15 && y == 0.0);
        let along = cylinder.reach([-2.0, 0.0]);
        assert!((along - TOOL.cylinder_radius_m / cos).abs() < 1e-12);
        assert!((cylinder.reach([0.0, 1.0]) - TOOL.cylinder_radius_m).abs() < 1e-15);
    }

    #[test]
    fn fallen_mallet_stays_finite() {
        let cylinder = MalletCylinder::along([0.0; 3], [1.0, 0.0, -0.0]);
        assert!(cylinder.axis_at(0.02)[0].is_finite() && cylinder.heights()[1] > 0.0);
    }
}
