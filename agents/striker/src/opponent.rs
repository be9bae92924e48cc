//! Predicts the opponent's mallet in `hit`, where it swings from side to side like a pendulum.

use crate::field::{Field, Vec2};
use nalgebra::{Matrix2, Vector2};

/// Angular frequency of the opponent's figure of eight, rad/s.
const FREQUENCY: f64 = 3.0;
/// Amplitude across the table, metres.
const AMPLITUDE: f64 = 0.16;
/// Phase of the published figure of eight at the episode's start, radians.
const PHASE: f64 = std::f64::consts::FRAC_PI_2 + 0.06;
/// Weight of the published motion against one observation.
const PRIOR_WEIGHT: f64 = 10.0;

/// Least-squares fit of `y = a cos ωt + b sin ωt` in the field frame.
#[derive(Debug, Clone)]
pub struct Opponent {
    normal: Matrix2<f64>,
    right: Vector2<f64>,
    x: f64,
}

impl Opponent {
    /// The published motion, before the first observation. The opponent's +y is the agent's −y.
    pub fn new(field: &Field) -> Self {
        let prior = Vector2::new(-AMPLITUDE * PHASE.cos(), AMPLITUDE * PHASE.sin());
        Self {
            normal: Matrix2::identity() * PRIOR_WEIGHT,
            right: prior * PRIOR_WEIGHT,
            x: field.base - 0.65,
        }
    }

    /// Updates the fit with the end effector, seen `time` seconds after the start.
    pub fn observe(&mut self, time: f64, seen: Vec2) {
        let basis = Vector2::new((FREQUENCY * time).cos(), (FREQUENCY * time).sin());
        self.normal += basis * basis.transpose();
        self.right += basis * seen.y;
        self.x += 0.05 * (seen.x - self.x);
    }

    /// Its expected y at `time`.
    pub fn y_at(&self, time: f64) -> f64 {
        let c = self
            .normal
            .try_inverse()
            .map_or_else(Vector2::zeros, |inverse| inverse * self.right);
        c.x * (FREQUENCY * time).cos() + c.y * (FREQUENCY * time).sin()
    }

    pub fn x(&self) -> f64 {
        self.x
    }
}
