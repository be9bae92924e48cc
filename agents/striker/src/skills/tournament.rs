//! The skill for whole games against another agent: defends the goal, frees the puck from the table's rim, and shoots.

use super::{Defend, Hit, Prepare};
use crate::field::Vec2;
use crate::motion::Pace;
use crate::scene::{MalletCommand, Scene};

/// After the puck has been on the own half for this time, it is shot also from positions that are avoided otherwise, seconds.
const URGENT_TIME: f64 = 6.0;

/// The mode `Hit` ends if no strike was possible for this time, seconds.
const STRIKE_TIMEOUT: f64 = 6.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// Waits in front of the goal while the puck is on the opponent's half.
    Wait,
    Defend,
    Prepare,
    Hit,
}

/// The skills of the three tasks, and the active mode.
#[derive(Debug, Clone)]
pub struct Tournament {
    mode: Mode,
    /// Time at which the mode began, seconds since the rally's start.
    mode_since: f64,
    /// Time at which the puck came to the own half, seconds since the rally's start. Staying there for 15 s is a foul.
    own_half_since: f64,
    hit: Hit,
    defend: Defend,
    prepare: Prepare,
}

impl Tournament {
    pub fn new() -> Self {
        Self {
            mode: Mode::Wait,
            mode_since: 0.0,
            own_half_since: 0.0,
            hit: Hit::new(),
            defend: Defend::new(),
            prepare: Prepare::new(),
        }
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        if scene.puck.pos.x > 0.0 {
            self.own_half_since = scene.time;
        }
        let is_busy = match self.mode {
            Mode::Hit => self.hit.is_committed(),
            Mode::Prepare => self.prepare.is_committed(),
            Mode::Wait | Mode::Defend => false,
        };
        let next_mode = if is_busy {
            self.mode
        } else {
            self.choose(scene)
        };
        if next_mode != self.mode {
            self.mode = next_mode;
            self.mode_since = scene.time;
            self.hit = Hit::new();
            self.defend = Defend::new();
            self.prepare = Prepare::new();
        }
        match self.mode {
            Mode::Hit => self.hit.decide(scene),
            Mode::Defend => self.defend.decide(scene),
            Mode::Prepare => self.prepare.decide(scene),
            Mode::Wait => {
                let y = (0.3 * scene.puck.pos.y).clamp(-0.1, 0.1);
                MalletCommand::stop(scene, Vec2::new(-0.83, y), Pace::CALM)
            }
        }
    }

    fn choose(&self, scene: &Scene<'_>) -> Mode {
        let puck = &scene.puck;
        let incoming = puck.vel.x < -0.4;
        if puck.pos.x > 0.02 {
            return if incoming { Mode::Defend } else { Mode::Wait };
        }
        if incoming || (self.mode == Mode::Defend && puck.vel.norm() > 0.5) {
            return Mode::Defend;
        }
        // Near a rim the mallet does not fit behind the puck: beyond this |y|, metres, the puck is freed first. The bound depends on the
        // mode, so that a puck near it does not switch modes at each step.
        let urgent = scene.time - self.own_half_since > URGENT_TIME;
        let shot_y_max = match (self.mode, urgent) {
            (Mode::Prepare, false) => 0.4,
            (Mode::Prepare, true) => 0.45,
            (_, false) => 0.445,
            (_, true) => 0.47,
        };
        if puck.pos.y.abs() > shot_y_max || puck.pos.x < -0.86 {
            return Mode::Prepare;
        }
        // No strike was possible for a long time: move the puck to avoid a foul.
        if self.mode == Mode::Hit && scene.time - self.mode_since > STRIKE_TIMEOUT {
            return Mode::Prepare;
        }
        Mode::Hit
    }
}
