//! Plans strikes: compares contact times and aims by the chance of a goal.

use super::shot::{Aim, candidate_aims, goal_chance};
use crate::arm::Side;
use crate::field::{Field, Vec2};
use crate::keeper::Keeper;
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, MALLET_RESTITUTION};
use crate::scene::{Scene, lean_side, waypoint};
use crate::skills::aim::strike_towards;

/// Duration of the run-up, seconds.
const RUN_UP: f64 = 0.32;
/// Limit of the accelerations of short run-ups, as speed² per metre of run-up, m/s².
const RUN_ACCELERATION: f64 = 30.0;
/// Latest contact considered, seconds from now.
const HORIZON: f64 = 2.2;
/// Decrease of a plan's chance per second of waiting.
const WAITING_COST: f64 = 0.02;
/// A shot with a lower chance is replaced by a nudge to a better position, if one is possible.
pub const NUDGE_THRESHOLD: f64 = 0.45;
/// The same threshold in a game, where another shot may follow and the opponent is in the way.
pub const NUDGE_THRESHOLD_IN_GAME: f64 = 0.06;
/// Pucks nearer to the own goal than this x may be nudged.
const NUDGE_FROM_X: f64 = -0.5;
/// Target x of a nudged puck …
const NUDGE_TO_X: f64 = -0.36;
/// … this long after the nudge, seconds.
const NUDGE_TIME: f64 = 2.6;

/// A strike at a chosen time.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Time of contact since the episode's start, seconds.
    pub contact_time: f64,
    /// Target on the goal line, and the way there.
    pub aim: Aim,
    pub mallet: Vec2,
    /// Direction of the mallet's motion and of the contact.
    pub normal: Vec2,
    /// Speed of the mallet at contact.
    pub speed: f64,
    /// Side of the arm's elbow.
    pub side: Side,
    /// Whether this is a nudge, which moves the puck forward for a later strike.
    pub nudge: bool,
    /// Chance of a goal.
    pub chance: f64,
}

impl Plan {
    /// Start of the run-up, and its duration in seconds.
    pub fn run_up(&self, field: &Field) -> (Vec2, f64) {
        let desired = self.mallet - 0.5 * self.speed * RUN_UP * self.normal;
        let start = field.clamp_mallet(desired);
        let room = (self.mallet - start).dot(&self.normal).max(0.02);
        (start, (2.0 * room / self.speed).min(RUN_UP))
    }
}

/// Updates a plan with the present estimate of the puck; `None` if it is too late or impossible.
pub fn refresh(scene: &Scene<'_>, plan: &Plan) -> Option<Plan> {
    let left = plan.contact_time - scene.time;
    (left > scene.dt)
        .then(|| replan(scene, plan, left, None))
        .flatten()
}

/// Plans the same strike again for a contact in `left` seconds.
pub fn replan(scene: &Scene<'_>, plan: &Plan, left: f64, speed: Option<f64>) -> Option<Plan> {
    if plan.nudge {
        nudge_at(scene, left, plan.side)
    } else {
        aim_at(scene, left, plan.aim, plan.side, speed)
    }
}

/// The earliest possible nudge.
pub fn best_nudge(scene: &Scene<'_>) -> Option<Plan> {
    let side = lean_side(scene.puck.pos);
    (0..20)
        .map(|k| 0.2 + 0.06 * f64::from(k))
        .find_map(|left| nudge_at(scene, left, side).filter(|plan| reachable(scene, plan, left)))
}

/// A gentle strike in `left` seconds that moves the puck to the best area for shots.
fn nudge_at(scene: &Scene<'_>, left: f64, side: Side) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) || puck.pos.x > NUDGE_FROM_X || puck.pos.y.abs() > 0.4 {
        return None;
    }
    let way = Vec2::new(NUDGE_TO_X, 0.8 * puck.pos.y) - puck.pos;
    let direction = way.normalize();
    let desired = way.norm() * DRAG / (1.0 - (-DRAG * NUDGE_TIME).exp());
    let speed =
        (desired + MALLET_RESTITUTION * puck.vel.dot(&direction)) / (1.0 + MALLET_RESTITUTION);
    if speed < 0.1 {
        return None;
    }
    let (normal, _) = strike_towards(&puck, direction, speed, field.contact());
    let mallet = puck.pos - field.contact() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9
        || room_behind(field, mallet, normal) < 0.02
    {
        return None;
    }
    let contact_time = scene.time + left;
    Some(Plan {
        contact_time,
        aim: Aim { y: 0.0, via: 0.0 },
        mallet,
        normal,
        speed,
        side,
        nudge: true,
        chance: NUDGE_THRESHOLD,
    })
}

/// The strike with the highest chance of a goal over contact times and aims.
pub fn best_plan(scene: &Scene<'_>) -> Option<Plan> {
    let mut best: Option<Plan> = None;
    let side = lean_side(scene.puck.pos);
    let mut left = RUN_UP + 0.1;
    let aims = candidate_aims(scene.keeper);
    // In a game there are four times as many aims, and another shot soon.
    let step = match scene.keeper {
        Keeper::Rival(_) => 0.12,
        Keeper::Unseen | Keeper::Pendulum(_) => 0.06,
    };
    while left < HORIZON {
        for &aim in &aims {
            if let Some(plan) = aim_at(scene, left, aim, side, None)
                && reachable(scene, &plan, left)
                && best.is_none_or(|b| plan.chance > b.chance)
            {
                best = Some(plan);
            }
        }
        left += step;
    }
    best
}

/// Whether the mallet can reach the start of the run-up in time, without haste.
fn reachable(scene: &Scene<'_>, plan: &Plan, left: f64) -> bool {
    let (start, run_up) = plan.run_up(scene.field);
    let way = waypoint(scene, start, scene.field.contact() + 0.015);
    let mut time = Target::stop(&scene.mallet, way, Pace::CALM).time;
    if way != start {
        time += 0.4;
    }
    if !plan.nudge {
        time = time.max(scene.arm.ready_time(scene.field.to_base(start), plan.side));
    }
    time <= left - run_up
}

/// Length of the run-up that fits on the table, metres.
fn room_behind(field: &Field, contact: Vec2, direction: Vec2) -> f64 {
    let limit = |pos: f64, step: f64, lo: f64, hi: f64| {
        if step > 1e-6 {
            (pos - lo) / step
        } else if step < -1e-6 {
            (pos - hi) / step
        } else {
            f64::INFINITY
        }
    };
    let y = field.mallet_y_max();
    let x = limit(contact.x, direction.x, field.mallet_x_min(), 0.0);
    x.min(limit(contact.y, direction.y, -y, y)).clamp(0.0, 1.0)
}

/// A strike in `left` seconds that sends the puck to `aim` on the goal line.
fn aim_at(scene: &Scene<'_>, left: f64, aim: Aim, side: Side, speed: Option<f64>) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) {
        return None;
    }
    let direction = aim.direction(field, puck.pos);
    let guess = puck.pos - field.contact() * direction;
    let speed = speed.unwrap_or_else(|| {
        let room = room_behind(field, guess, direction);
        let swing = scene
            .arm
            .strike_speed(field.to_base(guess), direction, side);
        swing.min((RUN_ACCELERATION * room).sqrt())
    });
    let (normal, struck) = aim.strike(field, &puck, speed);
    let mallet = puck.pos - field.contact() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 || mallet.x > -0.25 {
        return None;
    }
    let chance =
        goal_chance(field, scene.keeper, scene.time + left, &struck, aim) - WAITING_COST * left;
    Some(Plan {
        contact_time: scene.time + left,
        aim,
        mallet,
        normal,
        speed,
        side,
        nudge: false,
        chance,
    })
}
