//! The table frame and the base frames of the two robots, which face each other. Robots are 0 and 1.

use super::geometry::TABLE;

/// Sign of a robot's x and y axes in the table frame: robot 2's base frame is rotated by π.
#[inline(always)]
pub fn side(robot: usize) -> f64 {
    if robot == 0 { 1.0 } else { -1.0 }
}

/// A point of a robot's base frame in the table frame, m.
#[inline(always)]
pub fn table_from_robot(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let side = side(robot);
    [
        side * (p[0] - TABLE.base_x_m),
        side * p[1],
        p[2] + TABLE.base_z_m,
    ]
}

/// A point of the table frame in a robot's base frame, m.
pub fn robot_from_table(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let side = side(robot);
    [
        side * p[0] + TABLE.base_x_m,
        side * p[1],
        p[2] - TABLE.base_z_m,
    ]
}
