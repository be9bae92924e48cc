//! The numbers of table, goals and puck, in the table frame: origin at the centre of the surface, x towards robot 2, z up. The *rims* are
//! the walls around the table, two long ones along x and short ones beside the goals.

/// Dimensions of the table, and positions of the robots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Goal line to goal line, m.
    pub length_m: f64,
    /// Long side to long side, m.
    pub width_m: f64,
    /// Width of a goal's mouth, m.
    pub goal_width_m: f64,
    /// Thickness of the rims, from the inner face outwards, m.
    pub rim_thickness_m: f64,
    /// Radius of the rounded edge of the goal posts, the ends of the short rims, m.
    pub post_radius_m: f64,
    /// Distance of a robot's base from the table's centre, along x, m.
    pub base_x_m: f64,
    /// Height of a robot's base above the surface, m; negative, since it is below.
    pub base_z_m: f64,
}

impl Table {
    /// |x| of the goal lines and the short rims' faces, m.
    #[must_use]
    pub const fn half_length_m(&self) -> f64 {
        self.length_m / 2.0
    }

    /// |y| of the long rims' faces, m.
    #[must_use]
    pub const fn half_width_m(&self) -> f64 {
        self.width_m / 2.0
    }
}

/// The table of the 2023 Robot Air Hockey Challenge, in its last published version.
pub const TABLE: Table = Table {
    length_m: 1.948,
    width_m: 1.038,
    goal_width_m: 0.25,
    rim_thickness_m: 0.09,
    post_radius_m: 0.005,
    base_x_m: 1.51,
    base_z_m: -0.1,
};

/// A disc that slides on the surface, free in x, y and yaw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    pub radius_m: f64,
    /// kg.
    pub mass_kg: f64,
    /// Yaw inertia, kg m².
    pub inertia_kg_m2: f64,
    /// Viscous damping of the translation, N s/m.
    pub damping: f64,
    /// Viscous damping of the yaw, N m s.
    pub yaw_damping: f64,
    /// Top of the puck above the surface, m.
    pub height_m: f64,
}

/// The puck of the challenge.
pub const PUCK: Disc = Disc {
    radius_m: 0.03165,
    mass_kg: 0.01,
    inertia_kg_m2: 5e-6,
    damping: 0.005,
    yaw_damping: 2e-6,
    height_m: 0.02,
};
