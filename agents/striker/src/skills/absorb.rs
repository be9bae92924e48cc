//! Meeting a moving puck so that it stops.
//!
//! A mallet that retreats along the puck's path at a certain share of its speed lets it bounce off
//! with hardly any speed at all. A fast puck is met where the mallet can be in time with the least
//! effort; a slow one is overtaken, around it if need be, and met as soon as possible.

use crate::arm::Posture;
use crate::field::Vec2;
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, MALLET_RESTITUTION, Puck};
use crate::scene::{Order, Scene, around};

/// Pucks are best met with their centre between these.
const MEET_X: (f64, f64) = (-0.68, -0.4);
/// Where a puck shall come to rest that had to be met close to the goal.
const REST_X: f64 = -0.5;
/// Latest contact that is considered for a fast puck, seconds from now.
const FAST_HORIZON: f64 = 1.6;
/// The same for a slow one.
const SLOW_HORIZON: f64 = 3.0;
/// Above this speed a puck is fast, m/s.
const FAST: f64 = 0.6;
/// Slower pucks have stopped, m/s.
const STILL: f64 = 0.05;
/// The meeting is no longer corrected this long before it, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A touch that is nearer than this is cushioned, seconds.
const CUSHION_TIME: f64 = 0.07;
/// A planned contact stays if it differs from the cushioned one by less, m/s.
const AS_PLANNED: f64 = 0.2;
/// A running plan is given up only for one that is cheaper by this much.
const LOYALTY: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// Seconds since the episode's start.
    time: f64,
    mallet: Vec2,
    /// Velocity of the mallet at contact.
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Absorb {
    meeting: Option<Meeting>,
    /// Distance from the middle line that the puck must keep until it is met.
    keep_off_middle: f64,
}

impl Absorb {
    /// Nothing planned yet. Contacts nearer to the middle line than `keep_off_middle` are too late.
    pub fn new(keep_off_middle: f64) -> Self {
        Self {
            meeting: None,
            keep_off_middle,
        }
    }

    /// Forgets a plan that is not in its last moments.
    pub fn cancel(&mut self, scene: &Scene<'_>) -> bool {
        if self
            .meeting
            .is_some_and(|m| (m.time - scene.time).abs() <= 0.05)
        {
            return false;
        }
        self.meeting = None;
        true
    }

    /// The order for this control step; none if the puck cannot be met.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Option<Order> {
        if let Some(m) = self.meeting {
            let left = m.time - scene.time;
            if left <= 0.5 * scene.dt {
                // Through the contact and a little longer along with the puck, then stop.
                if left > -0.04 {
                    return Some(Order::coast(scene, m.velocity, Posture::Free));
                }
                self.meeting = None;
                return Some(Order::brake(scene));
            }
        }
        let last = self
            .meeting
            .filter(|m| m.time - scene.time < LAST_CORRECTION);
        if let Some(velocity) = cushion(scene)
            && last.is_none_or(|m| (m.velocity - velocity).norm() > AS_PLANNED)
        {
            self.meeting = None;
            return Some(Order::coast(scene, velocity, Posture::Free));
        }
        if let Some(m) = last {
            return Some(go(scene, &m));
        }
        if scene.puck.vel.norm() < FAST {
            self.catch_slow(scene)
        } else {
            self.meet_fast(scene)
        }
    }

    fn meet_fast(&mut self, scene: &Scene<'_>) -> Option<Order> {
        let kept = self
            .meeting
            .and_then(|m| priced(scene, m.time - scene.time));
        let best = best_meeting(scene);
        self.meeting = match (kept, best) {
            (Some((_, cost)), Some((b, least))) if least < cost - LOYALTY => Some(b),
            (Some((k, _)), _) => Some(k),
            (None, b) => b.map(|(b, _)| b),
        };
        self.meeting.map(|m| go(scene, &m))
    }

    fn catch_slow(&mut self, scene: &Scene<'_>) -> Option<Order> {
        let clearance = scene.field.contact() + 0.012;
        let possible = |left: f64| {
            let (meeting, puck) = meeting(scene, left)?;
            let early_enough = puck.pos.y.abs() > self.keep_off_middle;
            let way = around(scene, meeting.mallet, clearance);
            let detour = if way == meeting.mallet { 0.0 } else { 0.4 };
            let needed = Target::stop(&scene.mallet, way, Pace::QUICK).time + detour;
            (early_enough && needed <= left).then_some(meeting)
        };
        let kept = self
            .meeting
            .map(|m| m.time - scene.time)
            .filter(|left| *left > scene.dt);
        // Close to the contact the plan stays; before, the earliest possible contact is best.
        self.meeting = match kept {
            Some(left) if left < 0.3 => meeting(scene, left).map(|(m, _)| m),
            _ => (0..)
                .map(|k| 0.1 + 0.04 * f64::from(k))
                .take_while(|left| *left < SLOW_HORIZON)
                .find_map(possible),
        };
        let m = self.meeting?;
        let way = around(scene, m.mallet, clearance);
        Some(if way == m.mallet {
            go(scene, &m)
        } else {
            Order::stop(scene, way, Pace::QUICK)
        })
    }
}

/// The velocity that softens a touch which is about to happen, planned or not.
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
/// slower mallet sends one that came far back a little forward again.
fn retreat(speed: f64, along: Vec2, puck: Vec2) -> f64 {
    let back = if along.x < -0.5 {
        (DRAG * (REST_X - puck.x)).clamp(0.0, 0.25)
    } else {
        0.0
    };
    (MALLET_RESTITUTION * speed - back) / (1.0 + MALLET_RESTITUTION)
}

/// On the way to a meeting.
fn go(scene: &Scene<'_>, m: &Meeting) -> Order {
    let time = (m.time - scene.time).max(scene.dt);
    Order::new(
        Target {
            pos: m.mallet,
            vel: m.velocity,
            time,
        },
        Posture::Free,
    )
}

fn best_meeting(scene: &Scene<'_>) -> Option<(Meeting, f64)> {
    let mut best: Option<(Meeting, f64)> = None;
    let mut left = 2.0 * scene.dt;
    while left < FAST_HORIZON {
        if let Some((m, cost)) = priced(scene, left)
            && best.is_none_or(|(_, c)| cost < c)
        {
            best = Some((m, cost));
        }
        left += scene.dt;
    }
    best
}

/// Meeting the puck in `left` seconds; none if it is not there to be met.
fn meeting(scene: &Scene<'_>, left: f64) -> Option<(Meeting, Puck)> {
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
        Meeting {
            time: scene.time + left,
            mallet,
            velocity,
        },
        puck,
    ))
}

/// The meeting with a fast puck, and what it costs.
fn priced(scene: &Scene<'_>, left: f64) -> Option<(Meeting, f64)> {
    let (m, puck) = meeting(scene, left)?;
    if puck.vel.x > -0.3 * puck.vel.norm() {
        return None;
    }
    let target = Target {
        pos: m.mallet,
        vel: m.velocity,
        time: left,
    };
    let effort = scene.mallet.cost(&target, scene.field);
    let outside = (puck.pos.x - MEET_X.1).max(MEET_X.0 - puck.pos.x).max(0.0);
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
