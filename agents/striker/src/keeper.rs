//! The opponent's mallet as an obstacle for shots: the pendulum of `hit`, or the opponent in a game.

use crate::field::{Field, Vec2};
use crate::opponent::Opponent;

/// Averaging time of the mallet's position, seconds.
const MEMORY: f64 = 0.6;
/// Standard deviation of the mallet's position at the arrival of a shot if it has not moved so far, metres.
const REACTION: f64 = 0.004;

/// Mean and spread of recent positions of the opponent's mallet.
#[derive(Debug, Clone, Copy)]
pub struct Rival {
    /// Mean position, field frame.
    pub pos: Vec2,
    variance: f64,
}

impl Rival {
    /// A mallet seen for the first time.
    pub fn new(seen: Vec2) -> Self {
        Self {
            pos: seen,
            variance: 0.0,
        }
    }

    /// Updates mean and spread with a position, `dt` seconds after the last one.
    pub fn observe(&mut self, dt: f64, seen: Vec2) {
        let share = dt / MEMORY;
        let offset = seen - self.pos;
        self.pos += share * offset;
        self.variance += share * (offset.norm_squared() - self.variance);
    }

    /// Standard deviation of its future position, metres.
    pub fn deviation(&self) -> f64 {
        REACTION.hypot(self.variance.sqrt())
    }
}

/// The mallet in front of the opponent's goal.
#[derive(Debug, Clone)]
pub enum Keeper {
    /// No opponent on the table, or not seen yet.
    Unseen,
    /// The pendulum of `hit`.
    Pendulum(Opponent),
    /// The opponent in a game, whose motion is unknown.
    Rival(Rival),
}

impl Keeper {
    /// Updates the state with the opponent's mallet, seen `time` seconds after the start.
    pub fn observe(&mut self, field: &Field, in_game: bool, time: f64, dt: f64, seen: Vec2) {
        match self {
            Self::Unseen if in_game => *self = Self::Rival(Rival::new(seen)),
            Self::Unseen => {
                let mut opponent = Opponent::new(field);
                opponent.observe(time, seen);
                *self = Self::Pendulum(opponent);
            }
            Self::Pendulum(opponent) => opponent.observe(time, seen),
            Self::Rival(rival) => rival.observe(dt, seen),
        }
    }
}
