//! Predicts the opponent's mallet in the task `hit`, where it follows a published figure of eight: seen from the goal it swings from side
//! to side like a pendulum.

use crate::field::{Field, Vec2};
use nalgebra::{Matrix2, Vector2};

/// Angular frequency ω of the opponent's figure of eight, rad/s.
const FREQUENCY: f64 = 3.0;
/// Amplitude across the table, metres.
const AMPLITUDE: f64 = 0.16;
/// Distance of the figure's centre from the opponent's base, metres.
const CENTRE_FROM_BASE: f64 = 0.65;
/// Phase of the published figure of eight at the episode's start, radians.
const PHASE: f64 = std::f64::consts::FRAC_PI_2 + 0.06;
/// Weight of the published motion in the fit; an observation has weight 1.
const PRIOR_WEIGHT: f64 = 10.0;

/// Weight of one observation in the running mean of x.
const X_GAIN: f64 = 0.05;

/// Least-squares fit of the mallet's `y = a cos ωt + b sin ωt` in the field frame: the coefficients (a, b) solve
/// `normal_matrix · (a, b) = right_side`.
#[derive(Debug, Clone)]
pub struct Pendulum {
    normal_matrix: Matrix2<f64>,
    right_side: Vector2<f64>,
    /// Running mean of the mallet's x, metres.
    x: f64,
}

impl Pendulum {
    /// The published motion, before the first observation. The opponent's +y is the agent's −y.
    pub fn new(field: &Field) -> Self {
        let prior = Vector2::new(-AMPLITUDE * PHASE.cos(), AMPLITUDE * PHASE.sin());
        Self {
            normal_matrix: Matrix2::identity() * PRIOR_WEIGHT,
            right_side: prior * PRIOR_WEIGHT,
            x: field.base_distance - CENTRE_FROM_BASE,
        }
    }

    /// Updates the fit with the observed position of the mallet, `time` seconds after the episode's start.
    pub fn observe(&mut self, time: f64, observed: Vec2) {
        let basis = Vector2::new((FREQUENCY * time).cos(), (FREQUENCY * time).sin());
        self.normal_matrix += basis * basis.transpose();
        self.right_side += basis * observed.y;
        self.x += X_GAIN * (observed.x - self.x);
    }

    /// The mallet's expected y, `time` seconds after the episode's start.
    pub fn y_at(&self, time: f64) -> f64 {
        let coefficients = self
            .normal_matrix
            .try_inverse()
            .map_or_else(Vector2::zeros, |inverse| inverse * self.right_side);
        coefficients.x * (FREQUENCY * time).cos() + coefficients.y * (FREQUENCY * time).sin()
    }

    pub fn x(&self) -> f64 {
        self.x
    }
}
