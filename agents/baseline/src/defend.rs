//! Stops an incoming puck: the mallet waits at the point where the puck crosses a line in front of the goal.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::Target;
use striker::scene::{MalletCommand, Scene};

use crate::guard::guard;

/// x of the interception, metres.
const LINE_X: f64 = -0.56;
/// Prediction horizon for the crossing, seconds.
const HORIZON: f64 = 2.0;
/// Within this time before the contact the plan is kept, seconds.
const PLAN_TIME: f64 = 0.6;
/// Speed of the mallet's retreat as a share of the puck's speed.
const RETREAT_SHARE: f64 = 0.0;

#[derive(Debug, Clone, Copy)]
struct Interception {
    time: f64,
    mallet: Vec2,
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Defend {
    interception: Option<Interception>,
}

impl Defend {
    pub fn new() -> Self {
        Self { interception: None }
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let kept = self
            .interception
            .filter(|m| m.time - scene.time < PLAN_TIME && m.time - scene.time > -0.06);
        self.interception = kept.or_else(|| find_crossing(scene));
        let Some(m) = self.interception else {
            return guard(scene);
        };
        let left = m.time - scene.time;
        if left < 0.5 * scene.dt {
            return MalletCommand::coast(scene, m.velocity, Posture::Free);
        }
        MalletCommand::new(
            Target {
                pos: m.mallet,
                vel: m.velocity,
                time: left,
            },
            Posture::Free,
        )
    }
}

/// Position and time at which the puck crosses the line.
fn find_crossing(scene: &Scene<'_>) -> Option<Interception> {
    let mut puck = scene.puck;
    let mut left = 0.0;
    while left < HORIZON {
        if !puck.advance(scene.field, scene.dt) {
            return None;
        }
        left += scene.dt;
        if puck.pos.x < LINE_X + scene.field.contact() {
            let speed = puck.vel.norm();
            let mallet = puck.pos + scene.field.contact() * puck.vel / speed.max(1e-3);
            return Some(Interception {
                time: scene.time + left,
                mallet: scene.field.clamp_mallet(mallet),
                velocity: RETREAT_SHARE * puck.vel,
            });
        }
    }
    None
}
