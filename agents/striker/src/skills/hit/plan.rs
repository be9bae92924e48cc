//! Plans strikes: compares contact times and aims by the chance of a goal. If no shot is promising, it plans a *nudge*, a gentle strike
//! that moves the puck to a better position for a later shot.

use super::shot::{Aim, candidate_aims, goal_chance};
use crate::arm::Side;
use crate::field::{Field, Vec2};
use crate::keeper::Keeper;
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, MALLET_RESTITUTION};
use crate::scene::{Scene, elbow_side, waypoint};
use crate::skills::aim::strike_towards;

/// Duration of the run-up, seconds.
const RUN_UP_TIME: f64 = 0.32;
/// Limit of the speed after a short run-up: speed² per metre of run-up, m/s².
const SPEED_SQUARED_PER_RUN_UP: f64 = 30.0;
/// Latest contact considered for a shot, seconds from now.
const HORIZON: f64 = 2.2;
/// Decrease of a plan's chance per second of waiting.
const WAITING_COST: f64 = 0.02;
/// A shot with a lower chance is replaced by a nudge to a better position, if one is possible.
pub const NUDGE_THRESHOLD: f64 = 0.45;
/// The same threshold in a game, where another shot may follow and the opponent is in the way.
pub const NUDGE_THRESHOLD_IN_GAME: f64 = 0.06;
/// Pucks nearer to the own goal than this x may be nudged.
const NUDGE_FROM_X: f64 = -0.5;
/// Target x of a nudged puck, reached [`NUDGE_TIME`] after the nudge.
const NUDGE_TO_X: f64 = -0.36;
/// Time from a nudge until the puck reaches its target, seconds.
const NUDGE_TIME: f64 = 2.6;

/// Largest x of the mallet at the contact of a shot, metres: the arm can brake before the middle line.
const MALLET_X_MAX: f64 = -0.25;

/// A strike at a chosen time.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Time of contact since the episode's start, seconds.
    pub contact_time: f64,
    /// Target on the goal line, and the path to it.
    pub aim: Aim,
    /// Position of the mallet at contact.
    pub mallet: Vec2,
    /// Unit vector of the mallet's motion and of the contact normal, from mallet to puck.
    pub normal: Vec2,
    /// Speed of the mallet at contact, m/s.
    pub speed: f64,
    /// Side to which the arm's elbow leans.
    pub side: Side,
    /// Whether this is a nudge, which moves the puck forward for a later strike.
    pub is_nudge: bool,
    /// Chance of a goal.
    pub chance: f64,
}

impl Plan {
    /// Start of the run-up, and its duration in seconds.
    pub fn run_up(&self, field: &Field) -> (Vec2, f64) {
        let desired = self.mallet - 0.5 * self.speed * RUN_UP_TIME * self.normal;
        let start = field.clamp_mallet(desired);
        let room = (self.mallet - start).dot(&self.normal).max(0.02);
        (start, (2.0 * room / self.speed).min(RUN_UP_TIME))
    }
}

/// Updates a plan with the present estimate of the puck; `None` if it is too late or impossible.
pub fn refresh(scene: &Scene<'_>, plan: &Plan) -> Option<Plan> {
    let time_left = plan.contact_time - scene.time;
    (time_left > scene.dt)
        .then(|| replan(scene, plan, time_left, None))
        .flatten()
}

/// Plans the same strike again for a contact in `time_left` seconds; a shot with the given `speed`, if any.
pub fn replan(scene: &Scene<'_>, plan: &Plan, time_left: f64, speed: Option<f64>) -> Option<Plan> {
    if plan.is_nudge {
        plan_nudge(scene, time_left, plan.side)
    } else {
        plan_shot(scene, time_left, plan.aim, plan.side, speed)
    }
}

/// The earliest possible nudge; `None` if there is none in the next 1.3 seconds.
pub fn earliest_nudge(scene: &Scene<'_>) -> Option<Plan> {
    let side = elbow_side(scene.puck.pos);
    (0..20)
        .map(|k| 0.2 + 0.06 * f64::from(k))
        .find_map(|time_left| {
            plan_nudge(scene, time_left, side).filter(|plan| is_reachable(scene, plan, time_left))
        })
}

/// A gentle strike in `time_left` seconds that moves the puck to the best area for shots.
fn plan_nudge(scene: &Scene<'_>, time_left: f64, side: Side) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, time_left) || puck.pos.x > NUDGE_FROM_X || puck.pos.y.abs() > 0.4 {
        return None;
    }
    let path = Vec2::new(NUDGE_TO_X, 0.8 * puck.pos.y) - puck.pos;
    let direction = path.normalize();
    let puck_speed = path.norm() * DRAG / (1.0 - (-DRAG * NUDGE_TIME).exp());
    let speed =
        (puck_speed + MALLET_RESTITUTION * puck.vel.dot(&direction)) / (1.0 + MALLET_RESTITUTION);
    if speed < 0.1 {
        return None;
    }
    let (normal, _) = strike_towards(&puck, direction, speed, field.contact_distance());
    let mallet = puck.pos - field.contact_distance() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9
        || run_up_room(field, mallet, normal) < 0.02
    {
        return None;
    }
    let contact_time = scene.time + time_left;
    Some(Plan {
        contact_time,
        aim: Aim {
            y: 0.0,
            rim_side: 0.0,
        },
        mallet,
        normal,
        speed,
        side,
        is_nudge: true,
        chance: NUDGE_THRESHOLD,
    })
}

/// The strike with the highest chance of a goal over contact times and aims.
pub fn best_plan(scene: &Scene<'_>) -> Option<Plan> {
    let mut best: Option<Plan> = None;
    let side = elbow_side(scene.puck.pos);
    let mut time_left = RUN_UP_TIME + 0.1;
    let aims = candidate_aims(scene.keeper);
    // Time between the compared contacts, seconds. In a game there are four times as many aims, and another shot is possible soon.
    let step = match scene.keeper {
        Keeper::Opponent(_) => 0.12,
        Keeper::Unseen | Keeper::Pendulum(_) => 0.06,
    };
    while time_left < HORIZON {
        for &aim in &aims {
            if let Some(plan) = plan_shot(scene, time_left, aim, side, None)
                && is_reachable(scene, &plan, time_left)
                && best.is_none_or(|best| plan.chance > best.chance)
            {
                best = Some(plan);
            }
        }
        time_left += step;
    }
    best
}

/// Whether the mallet can reach the start of the run-up in time, without haste.
fn is_reachable(scene: &Scene<'_>, plan: &Plan, time_left: f64) -> bool {
    let (start, run_up) = plan.run_up(scene.field);
    let next_point = waypoint(scene, start, scene.field.contact_distance() + 0.015);
    let mut time = Target::stop(&scene.mallet, next_point, Pace::CALM).time;
    if next_point != start {
        // The detour around the puck.
        time += 0.4;
    }
    if !plan.is_nudge {
        time = time.max(
            scene
                .arm
                .posture_time(scene.field.to_base(start), plan.side),
        );
    }
    time <= time_left - run_up
}

/// Length of the run-up along `direction` to `contact` that fits into the mallet's area, metres.
fn run_up_room(field: &Field, contact: Vec2, direction: Vec2) -> f64 {
    let length_to_bound = |pos: f64, step: f64, low: f64, high: f64| {
        if step > 1e-6 {
            (pos - low) / step
        } else if step < -1e-6 {
            (pos - high) / step
        } else {
            f64::INFINITY
        }
    };
    let y = field.mallet_y_max();
    let x = length_to_bound(contact.x, direction.x, field.mallet_x_min(), 0.0);
    x.min(length_to_bound(contact.y, direction.y, -y, y))
        .clamp(0.0, 1.0)
}

/// A shot in `time_left` seconds that sends the puck to `aim` on the goal line. Without `speed` it is as fast as run-up and arm allow.
fn plan_shot(
    scene: &Scene<'_>,
    time_left: f64,
    aim: Aim,
    side: Side,
    speed: Option<f64>,
) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, time_left) {
        return None;
    }
    let direction = aim.direction(field, puck.pos);
    let mallet_estimate = puck.pos - field.contact_distance() * direction;
    let speed = speed.unwrap_or_else(|| {
        let room = run_up_room(field, mallet_estimate, direction);
        let arm_speed = scene
            .arm
            .strike_speed(field.to_base(mallet_estimate), direction, side);
        arm_speed.min((SPEED_SQUARED_PER_RUN_UP * room).sqrt())
    });
    let (normal, struck) = aim.strike(field, &puck, speed);
    let mallet = puck.pos - field.contact_distance() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 || mallet.x > MALLET_X_MAX {
        return None;
    }
    let chance = goal_chance(field, scene.keeper, scene.time + time_left, &struck, aim)
        - WAITING_COST * time_left;
    Some(Plan {
        contact_time: scene.time + time_left,
        aim,
        mallet,
        normal,
        speed,
        side,
        is_nudge: false,
        chance,
    })
}
