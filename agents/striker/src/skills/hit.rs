//! Striking the puck at the opponent's goal.
//!
//! Contact times over the next seconds are compared by the chance of a goal: a faster shot is
//! disturbed less by the air flow, a nearer one has less far to go, and the opponent must be
//! elsewhere when it arrives. The mallet waits behind the predicted contact and then accelerates
//! along the line of the shot so that it arrives at full speed at the chosen time.

use super::{Order, Scene, around, normal_cdf, strike_towards};
use crate::arm::Posture;
use crate::field::{Field, Vec2};
use crate::motion::{Pace, Target};
use crate::opponent::Opponent;
use crate::puck::{DRAG, Puck};

/// Duration of the run-up, seconds.
const RUN_UP: f64 = 0.32;
/// Latest contact that is considered, seconds from now.
const HORIZON: f64 = 2.2;
/// A running plan is given up only for one that is better by this much.
const LOYALTY: f64 = 0.06;
/// Chance that a second of waiting costs.
const IMPATIENCE: f64 = 0.05;
/// Goal-line points that are tried, metres.
const AIMS: [f64; 7] = [-0.06, -0.04, -0.02, 0.0, 0.02, 0.04, 0.06];

/// A strike at a chosen time.
#[derive(Debug, Clone, Copy)]
struct Plan {
    /// Time of contact since the episode's start, seconds.
    contact_time: f64,
    /// Where on the goal line the puck shall arrive.
    aim: f64,
    /// Mallet at contact.
    mallet: Vec2,
    /// Direction of the mallet's motion and of the contact.
    normal: Vec2,
    /// Speed of the mallet at contact.
    speed: f64,
    /// Chance of a goal.
    chance: f64,
}

impl Plan {
    fn run_up(&self, field: &Field) -> (Vec2, f64) {
        let wish = self.mallet - 0.5 * self.speed * RUN_UP * self.normal;
        let start = field.clamp_mallet(wish);
        let room = (self.mallet - start).dot(&self.normal).max(0.02);
        (start, (2.0 * room / self.speed).min(RUN_UP))
    }
}

#[derive(Debug, Clone, Copy)]
enum Phase {
    Seek(Option<Plan>),
    Swing(Plan),
    Follow { until: f64, rest_until: f64 },
}

/// The skill's memory.
#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
}

impl Hit {
    /// Nothing planned yet.
    pub fn new() -> Self {
        Self {
            phase: Phase::Seek(None),
        }
    }

    /// True while a strike must not be interrupted.
    pub fn committed(&self) -> bool {
        matches!(self.phase, Phase::Swing(_) | Phase::Follow { .. })
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
        match self.phase {
            Phase::Seek(old) => self.seek(scene, old),
            Phase::Swing(plan) => self.swing(scene, plan),
            Phase::Follow { until, rest_until } => {
                if scene.time >= rest_until {
                    self.phase = Phase::Seek(None);
                }
                if scene.time < until {
                    coast(scene)
                } else {
                    Order::brake(scene)
                }
            }
        }
    }

    fn seek(&mut self, scene: &Scene<'_>, old: Option<Plan>) -> Order {
        let kept = old.and_then(|p| refresh(scene, &p));
        let best = best_plan(scene);
        let plan = match (kept, best) {
            (Some(k), Some(b)) if b.chance > k.chance + LOYALTY => Some(b),
            (Some(k), _) => Some(k),
            (None, b) => b,
        };
        self.phase = Phase::Seek(plan);
        let Some(plan) = plan else {
            let behind = Vec2::new(
                scene.field.mallet_x_min() + 0.03,
                scene.puck.pos.y.clamp(-0.12, 0.12),
            );
            return Order::stop(
                scene,
                around(scene, behind, scene.field.contact() + 0.015),
                Pace::CALM,
            );
        };
        let (start, run_up) = plan.run_up(scene.field);
        let left = plan.contact_time - scene.time;
        if left <= run_up + 0.5 * scene.dt {
            self.phase = Phase::Swing(plan);
            return self.swing(scene, plan);
        }
        let goal = around(scene, start, scene.field.contact() + 0.015);
        let mut order = Order::stop(scene, goal, Pace::CALM);
        // Be there in time, not earlier than is comfortable.
        if goal == start {
            order.target.time = order.target.time.min((left - run_up).max(0.1));
        }
        order
    }

    fn swing(&mut self, scene: &Scene<'_>, plan: Plan) -> Order {
        let left = plan.contact_time - scene.time;
        if left <= 0.6 * scene.dt {
            self.phase = Phase::Follow {
                until: scene.time + 0.03,
                rest_until: scene.time + 0.5,
            };
            return coast(scene);
        }
        let plan = aim_at(scene, scene.time, left, plan.aim, Some(plan.speed)).unwrap_or(plan);
        self.phase = Phase::Swing(plan);
        Order {
            target: Target {
                pos: plan.mallet,
                vel: plan.speed * plan.normal,
                time: left,
            },
            posture: Posture::Fast,
        }
    }
}

/// Keep the present velocity.
fn coast(scene: &Scene<'_>) -> Order {
    let time = 0.1;
    let target = Target {
        pos: scene.mallet.pos + time * scene.mallet.vel,
        vel: scene.mallet.vel,
        time,
    };
    Order {
        target,
        posture: Posture::Fast,
    }
}

/// Mallet speed that the arm reaches for a radial strike at this place (field frame), m/s.
fn strike_speed(field: &Field, mallet: Vec2) -> f64 {
    let reach = field.to_base(mallet).norm();
    // Fit to the joint speed limits along the planar posture family, less a margin.
    let table = [
        (0.65, 1.70),
        (0.8, 1.60),
        (0.9, 1.50),
        (1.0, 1.37),
        (1.1, 1.19),
        (1.2, 1.0),
        (1.3, 0.78),
    ];
    let mut last = table[0];
    if reach <= last.0 {
        return last.1;
    }
    for point in table {
        if reach <= point.0 {
            let share = (reach - last.0) / (point.0 - last.0).max(1e-9);
            return last.1 + share * (point.1 - last.1);
        }
        last = point;
    }
    0.7
}

/// The same plan with the present estimate of the puck.
fn refresh(scene: &Scene<'_>, plan: &Plan) -> Option<Plan> {
    let left = plan.contact_time - scene.time;
    (left > 0.1)
        .then(|| aim_at(scene, scene.time, left, plan.aim, None))
        .flatten()
}

fn best_plan(scene: &Scene<'_>) -> Option<Plan> {
    let mut best: Option<Plan> = None;
    let mut left = RUN_UP + 0.1;
    while left < HORIZON {
        for aim in AIMS {
            if let Some(plan) = aim_at(scene, scene.time, left, aim, None) {
                if reachable(scene, &plan, left) && best.is_none_or(|b| plan.chance > b.chance) {
                    best = Some(plan);
                }
            }
        }
        left += 0.04;
    }
    best
}

/// Can the mallet be behind the puck in time without haste?
fn reachable(scene: &Scene<'_>, plan: &Plan, left: f64) -> bool {
    let (start, run_up) = plan.run_up(scene.field);
    let way = around(scene, start, scene.field.contact() + 0.015);
    let mut time = Target::stop(&scene.mallet, way, Pace::CALM).time;
    if way != start {
        time += 0.4;
    }
    time <= left - run_up
}

/// A strike in `left` seconds that sends the puck to `aim` on the goal line.
fn aim_at(scene: &Scene<'_>, now: f64, left: f64, aim: f64, speed: Option<f64>) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) {
        return None;
    }
    let goal = Vec2::new(field.half_length, aim);
    let direction = (goal - puck.pos).normalize();
    let guess = puck.pos - field.contact() * direction;
    let speed = speed.unwrap_or_else(|| strike_speed(field, guess));
    let (normal, struck) = strike_towards(&puck, direction, speed, field.contact());
    let mallet = puck.pos - field.contact() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 || mallet.x > -0.25 {
        return None;
    }
    let chance = chance(field, scene.opponent, now + left, &struck, aim) - IMPATIENCE * left;
    Some(Plan {
        contact_time: now + left,
        aim,
        mallet,
        normal,
        speed,
        chance,
    })
}

/// The chance that the struck puck passes the opponent and enters the goal.
fn chance(field: &Field, opponent: Option<&Opponent>, time: f64, struck: &Puck, aim: f64) -> f64 {
    let way = Vec2::new(field.half_length, aim) - struck.pos;
    let length = way.norm();
    let share = DRAG * length / struck.vel.norm().max(1e-3);
    if share > 0.9 {
        return 0.0;
    }
    let flight = -(1.0 - share).ln() / DRAG;
    // The air flow turns the heading at random; what it adds up to grows with way and time.
    let spread = (length * 0.11 * flight.sqrt()).hypot(length * 0.03);
    let within = |lo: f64, hi: f64| {
        if hi <= lo {
            0.0
        } else {
            normal_cdf((hi - aim) / spread) - normal_cdf((lo - aim) / spread)
        }
    };
    let half = field.half_goal - 0.6 * field.puck;
    let open = within(-half, half);
    let Some(opponent) = opponent else {
        return open;
    };
    let arrival = time + flight * (1.0 - (field.half_length - opponent.x()) / length);
    let y = opponent.y_at(arrival);
    let block = field.contact() + 0.005;
    open - within((y - block).max(-half), (y + block).min(half))
}
