//! Taking the energy out of an incoming puck.
//!
//! A mallet that retreats at a certain share of the puck's speed lets it bounce off with no speed at
//! all. The mallet therefore meets the puck on its predicted path, moving along with it.

use super::{Order, Scene};
use crate::arm::Posture;
use crate::field::Vec2;
use crate::motion::{Pace, Target};
use crate::puck::MALLET_RESTITUTION;

/// Mallet speed along the puck's motion that stops the puck: (1 + e) w = e v.
const RETREAT: f64 = MALLET_RESTITUTION / (1.0 + MALLET_RESTITUTION);
/// Where a puck is best stopped.
const BEST_X: f64 = -0.5;
/// Latest contact that is considered, seconds from now.
const HORIZON: f64 = 1.6;

/// A planned interception.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    time: f64,
    mallet: Vec2,
    velocity: Vec2,
}

/// The skill's memory.
#[derive(Debug, Clone)]
pub struct Defend {
    meeting: Option<Meeting>,
}

impl Defend {
    /// Nothing planned yet.
    pub fn new() -> Self {
        Self { meeting: None }
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
        if let Some(m) = self.meeting {
            let left = m.time - scene.time;
            if left <= 0.5 * scene.dt {
                // Through the contact and a little longer along with the puck, then stop.
                if left > -0.04 {
                    let target = Target {
                        pos: scene.mallet.pos + 0.1 * m.velocity,
                        vel: m.velocity,
                        time: 0.1,
                    };
                    return Order {
                        target,
                        posture: Posture::Free,
                    };
                }
                self.meeting = None;
                return Order::brake(scene);
            }
        }
        let kept = self.meeting.and_then(|m| meet(scene, m.time - scene.time));
        self.meeting = match kept {
            Some((m, cost)) => match best_meeting(scene) {
                Some((b, best)) if best < cost - 2.0 => Some(b),
                _ => Some(m),
            },
            None => best_meeting(scene).map(|(m, _)| m),
        };
        match self.meeting {
            Some(m) => Order {
                target: Target {
                    pos: m.mallet,
                    vel: m.velocity,
                    time: (m.time - scene.time).max(scene.dt),
                },
                posture: Posture::Free,
            },
            None => self.guard(scene),
        }
    }

    /// Stand between puck and goal.
    fn guard(&self, scene: &Scene<'_>) -> Order {
        let goal = Vec2::new(-scene.field.half_length, 0.0);
        let to_puck = scene.puck.pos - goal;
        let pos = goal + to_puck * (0.22 / to_puck.norm().max(0.22));
        Order::stop(scene, pos, Pace::CALM)
    }
}

fn best_meeting(scene: &Scene<'_>) -> Option<(Meeting, f64)> {
    let mut best: Option<(Meeting, f64)> = None;
    let mut left = 2.0 * scene.dt;
    while left < HORIZON {
        if let Some((m, cost)) = meet(scene, left) {
            if best.is_none_or(|(_, c)| cost < c) {
                best = Some((m, cost));
            }
        }
        left += scene.dt;
    }
    best
}

/// Meeting the puck in `left` seconds, and what it costs; none if it is not there to be met.
fn meet(scene: &Scene<'_>, left: f64) -> Option<(Meeting, f64)> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) {
        return None;
    }
    let speed = puck.vel.norm();
    if speed < 0.05 || puck.vel.x > -0.3 * speed || puck.pos.x > -0.25 {
        return None;
    }
    let along = puck.vel / speed;
    let mallet = puck.pos + field.contact() * along;
    let velocity = RETREAT * puck.vel;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
        return None;
    }
    let target = Target {
        pos: mallet,
        vel: velocity,
        time: left,
    };
    let effort = scene.mallet.cost(&target, field);
    let cost = 10.0 * (puck.pos.x - BEST_X).abs()
        + 0.3 * effort.acceleration
        + 20.0 * (effort.speed - 1.2).max(0.0)
        + 2.0 * (effort.acceleration - 10.0).max(0.0)
        + 200.0 * effort.excess
        + 1.0 * left;
    Some((
        Meeting {
            time: scene.time + left,
            mallet,
            velocity,
        },
        cost,
    ))
}
