//! Who may be in a shot's way: the pendulum of `hit`, or the other side of a game.

use crate::field::{Field, Vec2};
use crate::opponent::Opponent;

/// Time over which its usual place is averaged, seconds.
const MEMORY: f64 = 0.6;
/// Standard deviation of its place on arrival of a shot even if it never moved so far, metres.
const REACTION: f64 = 0.004;

/// Mean and spread of the places where the other mallet was seen lately.
#[derive(Debug, Clone, Copy)]
pub struct Rival {
    /// Its usual place, field frame.
    pub pos: Vec2,
    variance: f64,
}

impl Rival {
    /// Seen for the first time.
    pub fn new(seen: Vec2) -> Self {
        Self {
            pos: seen,
            variance: 0.0,
        }
    }

    /// Takes in where it is seen, `dt` seconds after the last time.
    pub fn observe(&mut self, dt: f64, seen: Vec2) {
        let share = dt / MEMORY;
        let way = seen - self.pos;
        self.pos += share * way;
        self.variance += share * (way.norm_squared() - self.variance);
    }

    /// Standard deviation of where it will stand, metres.
    pub fn deviation(&self) -> f64 {
        REACTION.hypot(self.variance.sqrt())
    }
}

/// Who keeps the other goal.
#[derive(Debug, Clone)]
pub enum Keeper {
    /// Nobody on the table, or not seen yet.
    Nobody,
    /// The pendulum of `hit`.
    Pendulum(Opponent),
    /// The other side of a game, which is no pendulum.
    Rival(Rival),
}

impl Keeper {
    /// Takes in the other mallet, seen at `time` seconds after the start.
    pub fn observe(&mut self, field: &Field, in_game: bool, time: f64, dt: f64, seen: Vec2) {
        match self {
            Self::Nobody if in_game => *self = Self::Rival(Rival::new(seen)),
            Self::Nobody => {
                let mut opponent = Opponent::new(field);
                opponent.observe(time, seen);
                *self = Self::Pendulum(opponent);
            }
            Self::Pendulum(opponent) => opponent.observe(time, seen),
            Self::Rival(rival) => rival.observe(dt, seen),
        }
    }
}
