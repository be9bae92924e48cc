//! Coordinate frames. The *table frame* has its origin in the centre of the table's surface, x towards the second robot, z up. Each of
//! the two robots, which face each other, has a *base frame* with x towards the table's centre, z up. Robots are 0 and 1 here, and robot
//! 1 and 2 in texts.

use super::geometry::TABLE;

/// Sign of a robot's x and y axes in the table frame: −1 for the second robot, whose base frame is rotated by π about z.
#[inline(always)]
pub fn axis_sign(robot: usize) -> f64 {
    if robot == 0 { 1.0 } else { -1.0 }
}

/// The table coordinates of the point `p`, given in a robot's base frame, m.
#[inline(always)]
pub fn table_from_robot(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let sign = axis_sign(robot);
    [
        sign * (p[0] - TABLE.base_x_m),
        sign * p[1],
        p[2] + TABLE.base_z_m,
    ]
}

/// The coordinates in a robot's base frame of the point `p`, given in the table frame, m.
pub fn robot_from_table(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let sign = axis_sign(robot);
    [
        sign * p[0] + TABLE.base_x_m,
        sign * p[1],
        p[2] - TABLE.base_z_m,
    ]
}
