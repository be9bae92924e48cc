//! The field frame, from the agent's side: origin at the table's centre, own goal at −x, lengths in metres. Also the table's
//! dimensions, and the area in which the mallet may move.

use nalgebra::Vector2;

use crate::env::Env;

/// A point or velocity in the plane of the table.
pub type Vec2 = Vector2<f64>;

/// Dimensions in the plane of the table, metres.
#[derive(Debug, Clone)]
pub struct Field {
    /// Half the length of the table.
    pub half_length: f64,
    /// Half its width.
    pub half_width: f64,
    /// Half the goal's width.
    pub half_goal: f64,
    /// Radius of the puck.
    pub puck_radius: f64,
    /// Radius of the mallet.
    pub mallet_radius: f64,
    /// Distance from the robot's base to the table's centre.
    pub base_distance: f64,
}

/// Distance, metres, of mallet references from the evaluator's bounds: the real mallet deviates a little from its reference.
const REFERENCE_MARGIN: f64 = 0.012;

/// Distance from the robot's base to the table's centre if the environment does not give it, metres.
const DEFAULT_BASE_DISTANCE: f64 = 1.51;

impl Field {
    /// Reads the dimensions from the environment.
    pub fn new(env: &Env) -> Self {
        Self {
            half_length: env.table.length / 2.0,
            half_width: env.table.width / 2.0,
            half_goal: env.table.goal_width / 2.0,
            puck_radius: env.puck.radius,
            mallet_radius: env.mallet.radius,
            base_distance: env.robot.base_distance_m().unwrap_or(DEFAULT_BASE_DISTANCE),
        }
    }

    /// Field coordinates of a point in the robot's base frame.
    pub fn to_field(&self, point: Vec2) -> Vec2 {
        Vec2::new(point.x - self.base_distance, point.y)
    }

    /// Base-frame coordinates of a point in the field.
    pub fn to_base(&self, point: Vec2) -> Vec2 {
        Vec2::new(point.x + self.base_distance, point.y)
    }

    /// Distance of the centres when mallet and puck touch.
    pub fn contact_distance(&self) -> f64 {
        self.puck_radius + self.mallet_radius
    }

    /// Largest |x| of the puck's centre in front of the short rims.
    pub fn puck_x_max(&self) -> f64 {
        self.half_length - self.puck_radius
    }

    /// Largest |y| of the puck's centre.
    pub fn puck_y_max(&self) -> f64 {
        self.half_width - self.puck_radius
    }

    /// Smallest x allowed for a mallet reference, the position that the arm is commanded to reach.
    pub fn mallet_x_min(&self) -> f64 {
        -self.half_length + self.mallet_radius + REFERENCE_MARGIN
    }

    /// Largest distance from the robot's base allowed for a mallet reference; the arm is nearly
    /// stretched there.
    pub fn reach_max(&self) -> f64 {
        1.36
    }

    /// Largest |y| allowed for a mallet reference.
    pub fn mallet_y_max(&self) -> f64 {
        self.half_width - self.mallet_radius - REFERENCE_MARGIN
    }

    /// Lowest and highest coordinates allowed for a mallet reference; the reach is another bound.
    pub fn mallet_bounds(&self) -> (Vec2, Vec2) {
        let y = self.mallet_y_max();
        (
            Vec2::new(self.mallet_x_min(), -y),
            Vec2::new(self.reach_max() - self.base_distance, y),
        )
    }

    /// The nearest point allowed for a mallet reference.
    pub fn clamp_mallet(&self, point: Vec2) -> Vec2 {
        let (low, high) = self.mallet_bounds();
        let point = Vec2::new(point.x.clamp(low.x, high.x), point.y.clamp(low.y, high.y));
        let from_base = self.to_base(point);
        let reach = from_base.norm();
        if reach <= self.reach_max() {
            point
        } else {
            self.to_field(from_base * (self.reach_max() / reach))
        }
    }
}
