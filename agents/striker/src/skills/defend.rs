//! Taking the energy out of an incoming puck.
//!
//! A mallet that retreats at a certain share of the puck's speed lets it bounce off with hardly any
//! speed at all. The mallet therefore meets the puck on its predicted path, moving along with it.
//! Where the puck would come to rest well by itself, the mallet keeps out of its way.

use super::{Order, Scene};
use crate::arm::Posture;
use crate::field::{Field, Vec2};
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, MALLET_RESTITUTION, Puck};

/// Pucks are best met with their centre between these.
const MEET_X: (f64, f64) = (-0.68, -0.4);
/// Where a puck shall come to rest that had to be met close to the goal.
const REST_X: f64 = -0.55;
/// The zone in which a puck may come to rest, with a margin.
const SAFE_X: (f64, f64) = (-0.74, -0.27);
/// Latest contact that is considered, seconds from now.
const HORIZON: f64 = 1.6;
/// Speed at which a puck counts as stopped, m/s.
const STOPPED: f64 = 0.1;
/// A running plan is given up only for one that is cheaper by this much.
const LOYALTY: f64 = 2.0;

/// A planned interception.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// Seconds since the episode's start.
    time: f64,
    /// Mallet at contact.
    mallet: Vec2,
    /// Velocity of the mallet at contact.
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
                    return Order::coast(scene, m.velocity, Posture::Free);
                }
                self.meeting = None;
                return Order::brake(scene);
            }
        }
        if rests_well(scene.field, scene.puck) {
            self.meeting = None;
            return give_way(scene);
        }
        let kept = self.meeting.and_then(|m| meet(scene, m.time - scene.time));
        let best = best_meeting(scene);
        self.meeting = match (kept, best) {
            (Some((_, cost)), Some((b, least))) if least < cost - LOYALTY => Some(b),
            (Some((k, _)), _) => Some(k),
            (None, b) => b.map(|(b, _)| b),
        };
        match self.meeting {
            Some(m) => {
                let time = (m.time - scene.time).max(scene.dt);
                Order::new(Target { pos: m.mallet, vel: m.velocity, time }, Posture::Free)
            }
            None => guard(scene),
        }
    }
}

/// Stand between puck and goal.
fn guard(scene: &Scene<'_>) -> Order {
    let goal = Vec2::new(-scene.field.half_length, 0.0);
    let to_puck = scene.puck.pos - goal;
    let pos = goal + to_puck * (0.22 / to_puck.norm().max(0.22));
    Order::stop(scene, pos, Pace::CALM)
}

/// Stay clear of a puck that needs no help.
fn give_way(scene: &Scene<'_>) -> Order {
    let away = scene.mallet.pos - (scene.puck.pos + 0.3 * scene.puck.vel);
    let distance = away.norm();
    if distance > 0.16 {
        return Order::brake(scene);
    }
    let pos = scene.mallet.pos + away * ((0.2 - distance) / distance.max(1e-3));
    Order::stop(scene, pos, Pace::CALM)
}

/// Will the puck, left alone, stop in the zone?
fn rests_well(field: &Field, mut puck: Puck) -> bool {
    let speed = puck.vel.norm();
    if puck.pos.x > 0.0 || speed > 0.8 {
        return false;
    }
    if speed > STOPPED {
        let time = (speed / STOPPED).ln() / DRAG;
        // Rims on the way do not matter as long as it stays in the zone.
        for _ in 0..8 {
            if !puck.advance(field, time / 8.0) || puck.pos.x > -0.05 {
                return false;
            }
        }
    }
    puck.pos.x > SAFE_X.0 && puck.pos.x < SAFE_X.1
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
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
        return None;
    }
    // (1 + e) w = e v stops the puck; a slower mallet sends it back a little.
    let back = (DRAG * (REST_X - puck.pos.x)).clamp(0.0, 0.25);
    let retreat = (MALLET_RESTITUTION * speed - back) / (1.0 + MALLET_RESTITUTION);
    let velocity = retreat * along;
    let target = Target { pos: mallet, vel: velocity, time: left };
    let effort = scene.mallet.cost(&target, field);
    let early = early_touch(scene, &target);
    let outside = (puck.pos.x - MEET_X.1).max(MEET_X.0 - puck.pos.x).max(0.0);
    let cost = 20.0 * outside
        + 0.3 * effort.acceleration
        + 20.0 * (effort.speed - 1.2).max(0.0)
        + 2.0 * (effort.acceleration - 10.0).max(0.0)
        + 200.0 * effort.excess
        + 300.0 * early
        + 2.0 * left;
    Some((Meeting { time: scene.time + left, mallet, velocity }, cost))
}

/// How deep the mallet would run into the puck before the planned contact, metres.
fn early_touch(scene: &Scene<'_>, target: &Target) -> f64 {
    let mut puck = scene.puck;
    let mut deepest: f64 = 0.0;
    let steps = 8;
    let span = target.time / f64::from(steps);
    for k in 1..steps {
        if !puck.advance(scene.field, span) {
            break;
        }
        let mallet = scene.mallet.towards(target, span * f64::from(k));
        deepest = deepest.max(scene.field.contact() - (puck.pos - mallet.pos).norm());
    }
    deepest
}
