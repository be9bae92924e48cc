//! The opponent's mallet as an obstacle for shots, called *keeper* because it guards the opponent's goal. In the task `hit` it swings
//! like a pendulum; in a game its motion is unknown.

use crate::field::{Field, Vec2};
use crate::pendulum::Pendulum;

/// Averaging time of the mallet's position, seconds.
const AVERAGING_TIME: f64 = 0.6;
/// Smallest standard deviation of the mallet's position at the arrival of a shot, for a mallet that has not moved so far, metres.
const MOTION_DEVIATION_MIN: f64 = 0.004;

/// Mean and spread of recent positions of the opponent's mallet.
#[derive(Debug, Clone, Copy)]
pub struct RecentPositions {
    /// Mean position, field frame.
    pub pos: Vec2,
    /// Variance of the positions, m².
    variance: f64,
}

impl RecentPositions {
    /// A mallet seen for the first time.
    pub fn new(observed: Vec2) -> Self {
        Self {
            pos: observed,
            variance: 0.0,
        }
    }

    /// Updates mean and spread with a position, `dt` seconds after the last one.
    pub fn observe(&mut self, dt: f64, observed: Vec2) {
        let share = dt / AVERAGING_TIME;
        let offset = observed - self.pos;
        self.pos += share * offset;
        self.variance += share * (offset.norm_squared() - self.variance);
    }

    /// Standard deviation of the mallet's future position, metres.
    pub fn deviation(&self) -> f64 {
        MOTION_DEVIATION_MIN.hypot(self.variance.sqrt())
    }
}

/// The mallet in front of the opponent's goal.
#[derive(Debug, Clone)]
pub enum Keeper {
    /// No opponent on the table, or not seen yet.
    Unseen,
    /// The swinging mallet of the task `hit`.
    Pendulum(Pendulum),
    /// The opponent in a game, whose motion is unknown.
    Opponent(RecentPositions),
}

impl Keeper {
    /// Updates the state with the observed position of the opponent's mallet, `time` seconds after the start of the episode, or of the
    /// rally if `in_game`.
    pub fn observe(&mut self, field: &Field, in_game: bool, time: f64, dt: f64, observed: Vec2) {
        match self {
            Self::Unseen if in_game => *self = Self::Opponent(RecentPositions::new(observed)),
            Self::Unseen => {
                let mut pendulum = Pendulum::new(field);
                pendulum.observe(time, observed);
                *self = Self::Pendulum(pendulum);
            }
            Self::Pendulum(pendulum) => pendulum.observe(time, observed),
            Self::Opponent(positions) => positions.observe(dt, observed),
        }
    }
}
