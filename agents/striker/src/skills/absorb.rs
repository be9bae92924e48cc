//! Intercepts a moving puck so that it stops.
//!
//! After contact with a mallet that retreats along the puck's path at a certain share of its speed,
//! the puck is nearly at rest. A fast puck is intercepted with the least effort; a slow one is
//! overtaken, with a detour if necessary, and intercepted as early as possible.

use crate::arm::Posture;
use crate::field::Vec2;
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, MALLET_RESTITUTION, Puck};
use crate::scene::{MalletCommand, Scene, waypoint};

/// Preferred x of the puck's centre at interception.
const INTERCEPT_X: (f64, f64) = (-0.68, -0.4);
/// Where a puck intercepted close to the goal shall come to rest.
const REST_X: f64 = -0.5;
/// Latest contact considered for a fast puck, seconds from now.
const FAST_HORIZON: f64 = 1.6;
/// Latest contact considered for a slow puck, seconds from now.
const SLOW_HORIZON: f64 = 3.0;
/// A puck above this speed is fast, m/s.
const FAST: f64 = 0.6;
/// A puck below this speed has stopped, m/s.
const STILL: f64 = 0.05;
/// The interception is no longer corrected this long before contact, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A contact expected within this time is cushioned, seconds.
const CUSHION_TIME: f64 = 0.07;
/// A planned contact is kept if its velocity differs from the cushioned one by less, m/s.
const PLAN_TOLERANCE: f64 = 0.2;
/// A plan is replaced only by one that is cheaper by this much.
const SWITCH_MARGIN: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct Interception {
    /// Seconds since the episode's start.
    time: f64,
    mallet: Vec2,
    /// Velocity of the mallet at contact.
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Absorb {
    interception: Option<Interception>,
    /// Minimum distance of the puck from the middle line at interception.
    min_middle_distance: f64,
}

impl Absorb {
    /// No plan yet. Contacts nearer to the middle line than `min_middle_distance` are too late.
    pub fn new(min_middle_distance: f64) -> Self {
        Self {
            interception: None,
            min_middle_distance,
        }
    }

    /// Drops the plan unless its contact is imminent; returns whether it was dropped.
    pub fn cancel(&mut self, scene: &Scene<'_>) -> bool {
        if self
            .interception
            .is_some_and(|m| (m.time - scene.time).abs() <= 0.05)
        {
            return false;
        }
        self.interception = None;
        true
    }

    /// The command for this control step; `None` if the puck cannot be intercepted.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        if let Some(m) = self.interception {
            let left = m.time - scene.time;
            if left <= 0.5 * scene.dt {
                // Continue through the contact and a little longer with the puck, then stop.
                if left > -0.04 {
                    return Some(MalletCommand::coast(scene, m.velocity, Posture::Free));
                }
                self.interception = None;
                return Some(MalletCommand::brake(scene));
            }
        }
        let last = self
            .interception
            .filter(|m| m.time - scene.time < LAST_CORRECTION);
        if let Some(velocity) = cushion(scene)
            && last.is_none_or(|m| (m.velocity - velocity).norm() > PLAN_TOLERANCE)
        {
            self.interception = None;
            return Some(MalletCommand::coast(scene, velocity, Posture::Free));
        }
        if let Some(m) = last {
            return Some(move_to(scene, &m));
        }
        if scene.puck.vel.norm() < FAST {
            self.intercept_slow(scene)
        } else {
            self.intercept_fast(scene)
        }
    }

    fn intercept_fast(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        let kept = self
            .interception
            .and_then(|m| interception_with_cost(scene, m.time - scene.time));
        let best = best_interception(scene);
        self.interception = match (kept, best) {
            (Some((_, cost)), Some((b, least))) if least < cost - SWITCH_MARGIN => Some(b),
            (Some((k, _)), _) => Some(k),
            (None, b) => b.map(|(b, _)| b),
        };
        self.interception.map(|m| move_to(scene, &m))
    }

    fn intercept_slow(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        let clearance = scene.field.contact() + 0.012;
        let possible = |left: f64| {
            let (plan, puck) = interception(scene, left)?;
            let early_enough = puck.pos.y.abs() > self.min_middle_distance;
            let way = waypoint(scene, plan.mallet, clearance);
            let detour = if way == plan.mallet { 0.0 } else { 0.4 };
            let needed = Target::stop(&scene.mallet, way, Pace::QUICK).time + detour;
            (early_enough && needed <= left).then_some(plan)
        };
        let kept = self
            .interception
            .map(|m| m.time - scene.time)
            .filter(|left| *left > scene.dt);
        // Close to the contact the plan is kept; before that, the earliest possible contact is best.
        self.interception = match kept {
            Some(left) if left < 0.3 => interception(scene, left).map(|(m, _)| m),
            _ => (0..)
                .map(|k| 0.1 + 0.04 * f64::from(k))
                .take_while(|left| *left < SLOW_HORIZON)
                .find_map(possible),
        };
        let m = self.interception?;
        let way = waypoint(scene, m.mallet, clearance);
        Some(if way == m.mallet {
            move_to(scene, &m)
        } else {
            MalletCommand::stop(scene, way, Pace::QUICK)
        })
    }
}

/// The mallet velocity that softens an imminent contact, planned or not.
fn cushion(scene: &Scene<'_>) -> Option<Vec2> {
    let offset = scene.mallet.pos - scene.puck.pos;
    let distance = offset.norm();
    let normal = offset / distance.max(1e-6);
    let gap = distance - scene.field.contact();
    let closing = (scene.puck.vel - scene.mallet.vel).dot(&normal);
    let along = scene.puck.vel.dot(&normal);
    let soon = closing > 0.1 && gap > -0.01 && gap < CUSHION_TIME * closing;
    (soon && along > 0.0).then(|| retreat(along, normal, scene.puck.pos) * normal)
}

/// The speed of the mallet along the puck's motion at contact: (1 + e) w = e v stops the puck, a
/// slower mallet sends a puck far back a little forward again.
fn retreat(speed: f64, along: Vec2, puck: Vec2) -> f64 {
    let back = if along.x < -0.5 {
        (DRAG * (REST_X - puck.x)).clamp(0.0, 0.25)
    } else {
        0.0
    };
    (MALLET_RESTITUTION * speed - back) / (1.0 + MALLET_RESTITUTION)
}

/// The command for a motion to an interception.
fn move_to(scene: &Scene<'_>, m: &Interception) -> MalletCommand {
    let time = (m.time - scene.time).max(scene.dt);
    MalletCommand::new(
        Target {
            pos: m.mallet,
            vel: m.velocity,
            time,
        },
        Posture::Free,
    )
}

fn best_interception(scene: &Scene<'_>) -> Option<(Interception, f64)> {
    let mut best: Option<(Interception, f64)> = None;
    let mut left = 2.0 * scene.dt;
    while left < FAST_HORIZON {
        if let Some((m, cost)) = interception_with_cost(scene, left)
            && best.is_none_or(|(_, c)| cost < c)
        {
            best = Some((m, cost));
        }
        left += scene.dt;
    }
    best
}

/// The interception in `left` seconds; `None` if it is impossible.
fn interception(scene: &Scene<'_>, left: f64) -> Option<(Interception, Puck)> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) {
        return None;
    }
    let speed = puck.vel.norm();
    if speed < STILL || puck.pos.x > -0.22 {
        return None;
    }
    let along = puck.vel / speed;
    let mallet = puck.pos + field.contact() * along;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
        return None;
    }
    let velocity = retreat(speed, along, puck.pos) * along;
    Some((
        Interception {
            time: scene.time + left,
            mallet,
            velocity,
        },
        puck,
    ))
}

/// The interception of a fast puck, and its cost.
fn interception_with_cost(scene: &Scene<'_>, left: f64) -> Option<(Interception, f64)> {
    let (m, puck) = interception(scene, left)?;
    if puck.vel.x > -0.3 * puck.vel.norm() {
        return None;
    }
    let target = Target {
        pos: m.mallet,
        vel: m.velocity,
        time: left,
    };
    let effort = scene.mallet.effort(&target, scene.field);
    let outside = (puck.pos.x - INTERCEPT_X.1)
        .max(INTERCEPT_X.0 - puck.pos.x)
        .max(0.0);
    let cost = 20.0 * outside
        + 0.3 * effort.acceleration
        + 20.0 * (effort.speed - 1.2).max(0.0)
        + 2.0 * (effort.acceleration - 10.0).max(0.0)
        + 200.0 * effort.excess
        + 300.0 * early_touch(scene, &target)
        + 2.0 * left;
    Some((m, cost))
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
