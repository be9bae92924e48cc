//! Stopping an incoming puck: where it crosses a line before the goal, the mallet is, and gives way a little.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::Target;
use striker::scene::{Order, Scene};

use crate::guard::guard;

/// Where the puck is met, metres.
const LINE_X: f64 = -0.56;
/// How far ahead the crossing is looked for, seconds.
const HORIZON: f64 = 2.0;
/// The plan is made this long before the contact and then kept, seconds.
const PLAN_TIME: f64 = 0.6;
/// Share of the puck's speed with which the mallet gives way.
const GIVE: f64 = 0.0;

#[derive(Debug, Clone, Copy)]
struct Meeting {
    time: f64,
    mallet: Vec2,
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Defend {
    meeting: Option<Meeting>,
}

impl Defend {
    pub fn new() -> Self {
        Self { meeting: None }
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
        let kept = self
            .meeting
            .filter(|m| m.time - scene.time < PLAN_TIME && m.time - scene.time > -0.06);
        self.meeting = kept.or_else(|| crossing(scene));
        let Some(m) = self.meeting else {
            return guard(scene);
        };
        let left = m.time - scene.time;
        if left < 0.5 * scene.dt {
            return Order::coast(scene, m.velocity, Posture::Free);
        }
        Order::new(
            Target {
                pos: m.mallet,
                vel: m.velocity,
                time: left,
            },
            Posture::Free,
        )
    }
}

/// Where and when the puck comes to the line.
fn crossing(scene: &Scene<'_>) -> Option<Meeting> {
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
            return Some(Meeting {
                time: scene.time + left,
                mallet: scene.field.clamp_mallet(mallet),
                velocity: GIVE * puck.vel,
            });
        }
    }
    None
}
