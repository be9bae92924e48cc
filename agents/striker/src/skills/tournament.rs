//! The whole game: defend against what comes, free the puck from the rim, shoot.

use super::{Defend, Hit, Prepare};
use crate::field::Vec2;
use crate::motion::Pace;
use crate::scene::{Order, Scene};

/// A puck that stayed this long is shot away from where it is not shot otherwise, seconds.
const URGENT: f64 = 6.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Wait,
    Defend,
    Prepare,
    Hit,
}

/// The skill's memory: the three tasks' skills and which one plays.
#[derive(Debug, Clone)]
pub struct Tournament {
    mode: Mode,
    since: f64,
    /// When the puck came to our side; a foul is 15 s later.
    ours_since: f64,
    hit: Hit,
    defend: Defend,
    prepare: Prepare,
}

impl Tournament {
    pub fn new() -> Self {
        Self {
            mode: Mode::Wait,
            since: 0.0,
            ours_since: 0.0,
            hit: Hit::new(),
            defend: Defend::new(),
            prepare: Prepare::new(),
        }
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
        if scene.puck.pos.x > 0.0 {
            self.ours_since = scene.time;
        }
        let busy = match self.mode {
            Mode::Hit => self.hit.committed(),
            Mode::Prepare => self.prepare.committed(),
            Mode::Wait | Mode::Defend => false,
        };
        let wanted = if busy { self.mode } else { self.choose(scene) };
        if wanted != self.mode {
            self.mode = wanted;
            self.since = scene.time;
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
                Order::stop(scene, Vec2::new(-0.83, y), Pace::CALM)
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
        // Near a rim there is no room for a mallet behind the puck.
        let urgent = scene.time - self.ours_since > URGENT;
        let margin = match (self.mode, urgent) {
            (Mode::Prepare, false) => 0.4,
            (Mode::Prepare, true) => 0.45,
            (_, false) => 0.445,
            (_, true) => 0.47,
        };
        if puck.pos.y.abs() > margin || puck.pos.x < -0.86 {
            return Mode::Prepare;
        }
        // A strike that could not be placed for long: move the puck elsewhere instead of fouling.
        if self.mode == Mode::Hit && scene.time - self.since > 6.0 {
            return Mode::Prepare;
        }
        Mode::Hit
    }
}
