//! The field frame, from the agent's side: origin at the table's centre, own goal at −x, metres.

use nalgebra::Vector2;

use crate::env::Env;

/// A point or velocity in the plane of the table.
pub type Vec2 = Vector2<f64>;

/// Dimensions in the plane.
#[derive(Debug, Clone)]
pub struct Field {
    /// Half the length of the table.
    pub half_length: f64,
    /// Half its width.
    pub half_width: f64,
    /// Half the goal's width.
    pub half_goal: f64,
    /// Radius of the puck.
    pub puck: f64,
    /// Radius of the mallet.
    pub mallet: f64,
    /// Distance from the robot's base to the table's centre.
    pub base: f64,
}

/// Margin of mallet references to the evaluator's bounds, for tracking errors.
const MARGIN: f64 = 0.012;

impl Field {
    /// Reads the dimensions from the environment.
    pub fn new(env: &Env) -> Self {
        Self {
            half_length: env.table.length / 2.0,
            half_width: env.table.width / 2.0,
            half_goal: env.table.goal_width / 2.0,
            puck: env.puck.radius,
            mallet: env.mallet.radius,
            base: env.robot.base_distance_m().unwrap_or(1.51),
        }
    }

    /// Field coordinates of a point in the robot's base frame.
    pub fn to_field(&self, p: Vec2) -> Vec2 {
        Vec2::new(p.x - self.base, p.y)
    }

    /// Base-frame coordinates of a point in the field.
    pub fn to_base(&self, p: Vec2) -> Vec2 {
        Vec2::new(p.x + self.base, p.y)
    }

    /// Distance of the centres when mallet and puck touch.
    pub fn contact(&self) -> f64 {
        self.puck + self.mallet
    }

    /// Largest |x| of the puck's centre in front of the short rims.
    pub fn puck_x(&self) -> f64 {
        self.half_length - self.puck
    }

    /// Largest |y| of the puck's centre.
    pub fn puck_y(&self) -> f64 {
        self.half_width - self.puck
    }

    /// Smallest x allowed for a mallet reference.
    pub fn mallet_x_min(&self) -> f64 {
        -self.half_length + self.mallet + MARGIN
    }

    /// Largest distance from the robot's base allowed for a mallet reference; the arm is nearly
    /// stretched there.
    pub fn reach_max(&self) -> f64 {
        1.36
    }

    /// Largest |y| allowed for a mallet reference.
    pub fn mallet_y_max(&self) -> f64 {
        self.half_width - self.mallet - MARGIN
    }

    /// Lowest and highest coordinates allowed for a mallet reference; the reach is another bound.
    pub fn mallet_bounds(&self) -> (Vec2, Vec2) {
        let y = self.mallet_y_max();
        (
            Vec2::new(self.mallet_x_min(), -y),
            Vec2::new(self.reach_max() - self.base, y),
        )
    }

    /// The nearest point allowed for a mallet reference.
    pub fn clamp_mallet(&self, p: Vec2) -> Vec2 {
        let (low, high) = self.mallet_bounds();
        let p = Vec2::new(p.x.clamp(low.x, high.x), p.y.clamp(low.y, high.y));
        let from_base = self.to_base(p);
        let reach = from_base.norm();
        if reach <= self.reach_max() {
            p
        } else {
            self.to_field(from_base * (self.reach_max() / reach))
        }
    }
}
