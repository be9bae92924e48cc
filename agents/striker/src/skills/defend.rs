//! Stops an incoming puck.
//!
//! The puck is intercepted so that it stops ([`Absorb`]). The task `defend` succeeds if the puck rests in the *zone*, a range of x on the
//! own half. If it will come to rest there without a contact, the mallet keeps clear of it.

use super::absorb::Absorb;
use crate::field::{Field, Vec2};
use crate::motion::Pace;
use crate::puck::{DRAG, Puck};
use crate::scene::{MalletCommand, Scene};

/// The zone's range of x, reduced by a margin, metres.
const ZONE_X: (f64, f64) = (-0.74, -0.27);
/// Speed at which a puck counts as stopped, m/s.
const STOPPED_SPEED: f64 = 0.1;

#[derive(Debug, Clone)]
pub struct Defend {
    absorb: Absorb,
}

impl Defend {
    pub fn new() -> Self {
        Self {
            absorb: Absorb::new(0.0),
        }
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        if will_rest_in_zone(scene.field, scene.puck) && self.absorb.cancel(scene) {
            return keep_clear(scene);
        }
        self.absorb.decide(scene).unwrap_or_else(|| guard(scene))
    }
}

/// Waits between puck and goal.
fn guard(scene: &Scene<'_>) -> MalletCommand {
    let goal = Vec2::new(-scene.field.half_length, 0.0);
    let to_puck = scene.puck.pos - goal;
    let pos = goal + to_puck * (0.22 / to_puck.norm().max(0.22));
    MalletCommand::stop(scene, pos, Pace::CALM)
}

/// Keeps clear of a puck that will stop in the zone.
fn keep_clear(scene: &Scene<'_>) -> MalletCommand {
    let away = scene.mallet.pos - (scene.puck.pos + 0.3 * scene.puck.vel);
    let distance = away.norm();
    if distance > 0.16 {
        return MalletCommand::brake(scene);
    }
    let pos = scene.mallet.pos + away * ((0.2 - distance) / distance.max(1e-3));
    MalletCommand::stop(scene, pos, Pace::CALM)
}

/// Whether the puck will stop in the zone without a contact.
fn will_rest_in_zone(field: &Field, mut puck: Puck) -> bool {
    let speed = puck.vel.norm();
    if puck.pos.x > 0.0 || speed > 0.8 {
        return false;
    }
    if speed > STOPPED_SPEED {
        let time = (speed / STOPPED_SPEED).ln() / DRAG;
        // Rims on the way do not matter as long as the puck stays on the own half.
        for _ in 0..8 {
            if !puck.advance(field, time / 8.0) || puck.pos.x > -0.05 {
                return false;
            }
        }
    }
    puck.pos.x > ZONE_X.0 && puck.pos.x < ZONE_X.1
}
