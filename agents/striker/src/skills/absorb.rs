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

/// Range of the preferred x of the puck's centre at interception, metres.
const INTERCEPT_X: (f64, f64) = (-0.68, -0.4);
/// x at which a puck intercepted close to the goal shall come to rest, metres.
const REST_X: f64 = -0.5;
/// Latest contact considered for a fast puck, seconds from now.
const FAST_HORIZON: f64 = 1.6;
/// Latest contact considered for a slow puck, seconds from now.
const SLOW_HORIZON: f64 = 3.0;
/// A puck above this speed is fast, m/s.
const FAST_SPEED: f64 = 0.6;
/// A puck below this speed has stopped, m/s.
const STOPPED_SPEED: f64 = 0.05;
/// The interception is no longer corrected this long before contact, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A contact expected within this time is cushioned, seconds.
const CUSHION_TIME: f64 = 0.07;
/// A planned contact is kept if its velocity differs from the cushioned one by less, m/s.
const PLAN_TOLERANCE: f64 = 0.2;
/// A plan is replaced only by one whose cost is lower by this much.
const SWITCH_MARGIN: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct Interception {
    /// Time of contact, seconds since the episode's start.
    time: f64,
    /// Position of the mallet at contact.
    mallet: Vec2,
    /// Velocity of the mallet at contact.
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Absorb {
    interception: Option<Interception>,
    /// Minimum |y| of the puck at interception, metres: nearer to the table's long axis is too late.
    min_axis_distance: f64,
}

impl Absorb {
    /// No plan yet. Contacts with a puck at a smaller |y| than `min_axis_distance` are too late.
    pub fn new(min_axis_distance: f64) -> Self {
        Self {
            interception: None,
            min_axis_distance,
        }
    }

    /// Drops the plan unless its contact is imminent; returns whether it was dropped.
    pub fn cancel(&mut self, scene: &Scene<'_>) -> bool {
        if self
            .interception
            .is_some_and(|plan| (plan.time - scene.time).abs() <= 0.05)
        {
            return false;
        }
        self.interception = None;
        true
    }

    /// The command for this control step; `None` if the puck cannot be intercepted.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        if let Some(plan) = self.interception {
            let time_left = plan.time - scene.time;
            if time_left <= 0.5 * scene.dt {
                // Continue through the contact and a little longer with the puck, then stop.
                if time_left > -0.04 {
                    return Some(MalletCommand::coast(scene, plan.velocity, Posture::Any));
                }
                self.interception = None;
                return Some(MalletCommand::brake(scene));
            }
        }
        let imminent = self
            .interception
            .filter(|plan| plan.time - scene.time < LAST_CORRECTION);
        if let Some(velocity) = cushioned_velocity(scene)
            && imminent.is_none_or(|plan| (plan.velocity - velocity).norm() > PLAN_TOLERANCE)
        {
            self.interception = None;
            return Some(MalletCommand::coast(scene, velocity, Posture::Any));
        }
        if let Some(plan) = imminent {
            return Some(move_to(scene, &plan));
        }
        if scene.puck.vel.norm() < FAST_SPEED {
            self.intercept_slow(scene)
        } else {
            self.intercept_fast(scene)
        }
    }

    /// Plans the cheapest interception of a fast puck.
    fn intercept_fast(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        let current = self
            .interception
            .and_then(|plan| plan_with_cost(scene, plan.time - scene.time));
        let best = cheapest_interception(scene);
        self.interception = match (current, best) {
            (Some((_, cost)), Some((better, least))) if least < cost - SWITCH_MARGIN => {
                Some(better)
            }
            (Some((kept, _)), _) => Some(kept),
            (None, best) => best.map(|(plan, _)| plan),
        };
        self.interception.map(|plan| move_to(scene, &plan))
    }

    /// Plans the earliest interception of a slow puck.
    fn intercept_slow(&mut self, scene: &Scene<'_>) -> Option<MalletCommand> {
        let clearance = scene.field.contact_distance() + 0.012;
        let possible = |time_left: f64| {
            let (plan, puck) = plan_interception(scene, time_left)?;
            let early_enough = puck.pos.y.abs() > self.min_axis_distance;
            let next_point = waypoint(scene, plan.mallet, clearance);
            let detour = if next_point == plan.mallet { 0.0 } else { 0.4 };
            let needed_time = Target::stop(&scene.mallet, next_point, Pace::QUICK).time + detour;
            (early_enough && needed_time <= time_left).then_some(plan)
        };
        let current = self
            .interception
            .map(|plan| plan.time - scene.time)
            .filter(|time_left| *time_left > scene.dt);
        // Close to the contact the plan is kept; before that, the earliest possible contact is best.
        self.interception = match current {
            Some(time_left) if time_left < 0.3 => {
                plan_interception(scene, time_left).map(|(plan, _)| plan)
            }
            _ => (0..)
                .map(|k| 0.1 + 0.04 * f64::from(k))
                .take_while(|time_left| *time_left < SLOW_HORIZON)
                .find_map(possible),
        };
        let plan = self.interception?;
        let next_point = waypoint(scene, plan.mallet, clearance);
        Some(if next_point == plan.mallet {
            move_to(scene, &plan)
        } else {
            MalletCommand::stop(scene, next_point, Pace::QUICK)
        })
    }
}

/// The mallet velocity that softens an imminent contact, planned or not.
fn cushioned_velocity(scene: &Scene<'_>) -> Option<Vec2> {
    let offset = scene.mallet.pos - scene.puck.pos;
    let distance = offset.norm();
    let normal = offset / distance.max(1e-6);
    let gap = distance - scene.field.contact_distance();
    let closing = (scene.puck.vel - scene.mallet.vel).dot(&normal);
    let puck_speed = scene.puck.vel.dot(&normal);
    let is_imminent = closing > 0.1 && gap > -0.01 && gap < CUSHION_TIME * closing;
    (is_imminent && puck_speed > 0.0)
        .then(|| retreat_speed(puck_speed, normal, scene.puck.pos) * normal)
}

/// The speed of the mallet along the puck's motion at contact. With restitution e, a mallet of speed w with (1 + e) w = e v stops a
/// puck of speed v. Close to the own goal the mallet is slower, which sends the puck a little forward again. `direction` is that of the
/// retreat, a unit vector.
fn retreat_speed(speed: f64, direction: Vec2, puck: Vec2) -> f64 {
    let forward_speed = if direction.x < -0.5 {
        (DRAG * (REST_X - puck.x)).clamp(0.0, 0.25)
    } else {
        0.0
    };
    (MALLET_RESTITUTION * speed - forward_speed) / (1.0 + MALLET_RESTITUTION)
}

/// The command for a motion to an interception.
fn move_to(scene: &Scene<'_>, plan: &Interception) -> MalletCommand {
    let time = (plan.time - scene.time).max(scene.dt);
    MalletCommand::new(
        Target {
            pos: plan.mallet,
            vel: plan.velocity,
            time,
        },
        Posture::Any,
    )
}

/// The fast puck's interception of least cost, and its cost.
fn cheapest_interception(scene: &Scene<'_>) -> Option<(Interception, f64)> {
    let mut best: Option<(Interception, f64)> = None;
    let mut time_left = 2.0 * scene.dt;
    while time_left < FAST_HORIZON {
        if let Some((plan, cost)) = plan_with_cost(scene, time_left)
            && best.is_none_or(|(_, c)| cost < c)
        {
            best = Some((plan, cost));
        }
        time_left += scene.dt;
    }
    best
}

/// The interception in `time_left` seconds and the puck then; `None` if it is impossible.
fn plan_interception(scene: &Scene<'_>, time_left: f64) -> Option<(Interception, Puck)> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, time_left) {
        return None;
    }
    let speed = puck.vel.norm();
    if speed < STOPPED_SPEED || puck.pos.x > -0.22 {
        return None;
    }
    let along = puck.vel / speed;
    let mallet = puck.pos + field.contact_distance() * along;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
        return None;
    }
    let velocity = retreat_speed(speed, along, puck.pos) * along;
    Some((
        Interception {
            time: scene.time + time_left,
            mallet,
            velocity,
        },
        puck,
    ))
}

/// The interception of a fast puck, and its cost.
fn plan_with_cost(scene: &Scene<'_>, time_left: f64) -> Option<(Interception, f64)> {
    let (plan, puck) = plan_interception(scene, time_left)?;
    // Only a puck that moves towards the own goal is worth the effort.
    if puck.vel.x > -0.3 * puck.vel.norm() {
        return None;
    }
    let target = Target {
        pos: plan.mallet,
        vel: plan.velocity,
        time: time_left,
    };
    let effort = scene.mallet.effort(&target, scene.field);
    let outside = (puck.pos.x - INTERCEPT_X.1)
        .max(INTERCEPT_X.0 - puck.pos.x)
        .max(0.0);
    // Weights found by trial in simulated episodes; only their proportions matter.
    let cost = 20.0 * outside
        + 0.3 * effort.acceleration
        + 20.0 * (effort.speed - 1.2).max(0.0)
        + 2.0 * (effort.acceleration - 10.0).max(0.0)
        + 200.0 * effort.excess
        + 300.0 * early_overlap(scene, &target)
        + 2.0 * time_left;
    Some((plan, cost))
}

/// How deep the mallet would run into the puck before the planned contact, metres.
fn early_overlap(scene: &Scene<'_>, target: &Target) -> f64 {
    let mut puck = scene.puck;
    let mut deepest: f64 = 0.0;
    let steps = 8;
    let span = target.time / f64::from(steps);
    for k in 1..steps {
        if !puck.advance(scene.field, span) {
            break;
        }
        let mallet = scene.mallet.towards(target, span * f64::from(k));
        deepest = deepest.max(scene.field.contact_distance() - (puck.pos - mallet.pos).norm());
    }
    deepest
}
