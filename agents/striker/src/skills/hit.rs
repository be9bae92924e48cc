//! Striking the puck at the opponent's goal.
//!
//! Contact times over the next seconds are compared by the chance of a goal: a faster shot is
//! disturbed less by the air flow, a nearer one has less far to go, and the opponent must be
//! elsewhere when it arrives. The mallet waits behind the predicted contact and then accelerates
//! along the line of the shot so that it arrives at full speed at the chosen time.

use super::{Order, Prepare, Scene, around, lean, normal_cdf, strike_towards};
use crate::arm::{Posture, Side};
use crate::estimator::{FLOW_PER_SPEED, FLOW_TIME};
use crate::field::{Field, Vec2};
use crate::motion::{Pace, Target};
use crate::opponent::Opponent;
use crate::puck::{DRAG, MALLET_RESTITUTION, Puck};

/// Duration of the run-up, seconds.
const RUN_UP: f64 = 0.32;
/// What speed² a run-up of one metre could reach: bounds the accelerations of short run-ups, m/s².
const RUN_ACCELERATION: f64 = 30.0;
/// Latest contact that is considered, seconds from now.
const HORIZON: f64 = 2.2;
/// A running plan is given up only for one that is better by this much.
const LOYALTY: f64 = 0.06;
/// Chance that a second of waiting costs.
const IMPATIENCE: f64 = 0.05;
/// Standard deviation of a shot's direction without air flow, radians.
const AIM_ERROR: f64 = 0.03;
/// Shots with less chance are not taken while the puck can be nudged to a better place.
const WORTH_A_NUDGE: f64 = 0.4;
/// Nudges per episode.
const NUDGES_MAX: u32 = 1;
/// Pucks nearer to our goal are worth a nudge.
const NUDGE_FROM_X: f64 = -0.68;
/// Where a nudged puck shall be …
const NUDGE_TO_X: f64 = -0.38;
/// … this long after the nudge, seconds.
const NUDGE_TIME: f64 = 2.6;
/// Largest acceleration of a strike, m/s².
const STRIKE_ACCELERATION: f64 = 45.0;
/// The same for a nudge, m/s².
const NUDGE_ACCELERATION: f64 = 14.0;
/// The contact is no longer corrected this long before it, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A puck slower than this that cannot be struck will not come into reach by itself, m/s.
const STILL: f64 = 0.08;
/// Goal-line points that are tried, metres.
const AIMS: [f64; 5] = [-0.05, -0.025, 0.0, 0.025, 0.05];

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
    /// To which side the arm leans.
    side: Side,
    /// Moves the puck forward to be struck again, instead of shooting.
    nudge: bool,
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

/// Where and when the mallet comes to rest after a strike.
#[derive(Debug, Clone, Copy)]
struct Stop {
    pos: Vec2,
    time: f64,
}

impl Stop {
    fn plan(scene: &Scene<'_>) -> Self {
        let motion = scene.mallet;
        let speed = motion.vel.norm().max(1e-3);
        let wish = motion.pos + 0.5 * (0.08 + 0.14 * speed) * motion.vel;
        let pos = scene.field.clamp_mallet(wish);
        // A quintic to rest is even if it covers half of speed × time.
        let time = (2.0 * (pos - motion.pos).norm() / speed).max(0.1);
        Self {
            pos,
            time: scene.time + time,
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Phase {
    Seek(Option<Plan>),
    Swing(Plan),
    /// `through`: until when at full speed; `rest`: how long to wait after stopping.
    Follow {
        through: f64,
        stop: Option<Stop>,
        rest: f64,
    },
}

/// The skill's memory.
#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
    /// Frees a puck that cannot be struck where it lies.
    rescue: Option<Prepare>,
    /// Nudges so far.
    nudges: u32,
}

impl Hit {
    /// Nothing planned yet.
    pub fn new() -> Self {
        Self {
            phase: Phase::Seek(None),
            rescue: None,
            nudges: 0,
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
            Phase::Follow {
                through,
                stop,
                rest,
            } => self.follow(scene, through, stop, rest),
        }
    }

    fn seek(&mut self, scene: &Scene<'_>, old: Option<Plan>) -> Order {
        if let Some(rescue) = self.rescue.as_mut().filter(|r| r.committed()) {
            return rescue.decide(scene);
        }
        let kept = old.and_then(|p| refresh(scene, &p));
        let mut best = best_plan(scene);
        if self.nudges < NUDGES_MAX && best.is_some_and(|b| b.chance < WORTH_A_NUDGE) {
            best = best_nudge(scene).or(best);
        }
        let plan = match (kept, best) {
            (Some(k), Some(b)) if b.chance > k.chance + LOYALTY => Some(b),
            (Some(k), _) => Some(k),
            (None, b) => b,
        };
        self.phase = Phase::Seek(plan);
        let Some(plan) = plan else {
            if scene.puck.vel.norm() < STILL && scene.puck.pos.x < -0.1 {
                return self.rescue.get_or_insert_with(Prepare::new).decide(scene);
            }
            self.rescue = None;
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
        self.rescue = None;
        let (start, run_up) = plan.run_up(scene.field);
        let left = plan.contact_time - scene.time;
        if left <= run_up + 0.5 * scene.dt {
            self.phase = Phase::Swing(plan);
            return self.swing(scene, plan);
        }
        let goal = around(scene, start, scene.field.contact() + 0.015);
        let mut order = Order::stop(scene, goal, Pace::CALM);
        order.posture = Posture::Ready(plan.side);
        // Be there in time, not earlier than is comfortable.
        if goal == start {
            order.target.time = order.target.time.min((left - run_up).max(0.1));
        }
        order
    }

    fn swing(&mut self, scene: &Scene<'_>, plan: Plan) -> Order {
        let left = plan.contact_time - scene.time;
        if left <= 0.6 * scene.dt {
            // A nudged puck is followed at once, a shot puck is gone.
            let rest = if plan.nudge { 0.0 } else { 0.2 };
            self.nudges += u32::from(plan.nudge);
            self.phase = Phase::Follow {
                through: scene.time + 0.03,
                stop: None,
                rest,
            };
            return self.follow(scene, scene.time + 0.03, None, rest);
        }
        // In the last moments corrections would be jerks, and a touch already shows in the estimate.
        let plan = if left > LAST_CORRECTION {
            again(scene, &plan, left, Some(plan.speed)).unwrap_or(plan)
        } else {
            plan
        };
        self.phase = Phase::Swing(plan);
        Order {
            target: Target {
                pos: plan.mallet,
                vel: plan.speed * plan.normal,
                time: left,
            },
            posture: Posture::Strike(plan.side),
            acceleration: if plan.nudge { NUDGE_ACCELERATION } else { STRIKE_ACCELERATION },
        }
    }

    /// Through the contact at full speed, then to a stop on a path that is fixed once, so that the
    /// deceleration is even.
    fn follow(&mut self, scene: &Scene<'_>, through: f64, stop: Option<Stop>, rest: f64) -> Order {
        let posture = Posture::Strike(lean(scene.mallet.pos));
        if scene.time < through {
            return Order::coast(scene, scene.mallet.vel, posture);
        }
        let stop = stop.unwrap_or_else(|| Stop::plan(scene));
        let left = stop.time - scene.time;
        self.phase = if left < -rest {
            Phase::Seek(None)
        } else {
            Phase::Follow {
                through,
                stop: Some(stop),
                rest,
            }
        };
        if left < scene.dt {
            return Order::stop(scene, scene.mallet.pos, Pace::CALM);
        }
        Order::new(
            Target {
                pos: stop.pos,
                vel: Vec2::zeros(),
                time: left,
            },
            Posture::Ready(lean(stop.pos)),
        )
    }
}

/// The same plan with the present estimate of the puck, if there is still time to change it.
fn refresh(scene: &Scene<'_>, plan: &Plan) -> Option<Plan> {
    let left = plan.contact_time - scene.time;
    (left > scene.dt)
        .then(|| again(scene, plan, left, None))
        .flatten()
}

/// The same plan, `left` seconds before the contact.
fn again(scene: &Scene<'_>, plan: &Plan, left: f64, speed: Option<f64>) -> Option<Plan> {
    if plan.nudge {
        nudge_at(scene, left, plan.side)
    } else {
        aim_at(scene, left, plan.aim, plan.side, speed)
    }
}

/// The earliest nudge that can be made.
fn best_nudge(scene: &Scene<'_>) -> Option<Plan> {
    let side = lean(scene.puck.pos);
    (0..20)
        .map(|k| 0.2 + 0.06 * f64::from(k))
        .find_map(|left| nudge_at(scene, left, side).filter(|plan| reachable(scene, plan, left)))
}

/// A gentle strike in `left` seconds after which the puck drifts to where shots are best.
fn nudge_at(scene: &Scene<'_>, left: f64, side: Side) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) || puck.pos.x > NUDGE_FROM_X || puck.pos.y.abs() > 0.4 {
        return None;
    }
    let way = Vec2::new(NUDGE_TO_X, 0.8 * puck.pos.y) - puck.pos;
    let direction = way.normalize();
    let wanted = way.norm() * DRAG / (1.0 - (-DRAG * NUDGE_TIME).exp());
    let speed =
        (wanted + MALLET_RESTITUTION * puck.vel.dot(&direction)) / (1.0 + MALLET_RESTITUTION);
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
        aim: 0.0,
        mallet,
        normal,
        speed,
        side,
        nudge: true,
        chance: WORTH_A_NUDGE,
    })
}

fn best_plan(scene: &Scene<'_>) -> Option<Plan> {
    let mut best: Option<Plan> = None;
    let side = lean(scene.puck.pos);
    let mut left = RUN_UP + 0.1;
    while left < HORIZON {
        for aim in AIMS {
            if let Some(plan) = aim_at(scene, left, aim, side, None) {
                if reachable(scene, &plan, left) && best.is_none_or(|b| plan.chance > b.chance) {
                    best = Some(plan);
                }
            }
        }
        left += 0.06;
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
    if !plan.nudge {
        time = time.max(scene.arm.ready_time(scene.field.to_base(start), plan.side));
    }
    time <= left - run_up
}

/// Length of the run-up that the table allows, metres.
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
    let x = limit(
        contact.x,
        direction.x,
        field.mallet_x_min(),
        0.0,
    );
    x.min(limit(contact.y, direction.y, -y, y)).clamp(0.0, 1.0)
}

/// A strike in `left` seconds that sends the puck to `aim` on the goal line.
fn aim_at(scene: &Scene<'_>, left: f64, aim: f64, side: Side, speed: Option<f64>) -> Option<Plan> {
    let field = scene.field;
    let mut puck = scene.puck;
    if !puck.advance(field, left) {
        return None;
    }
    let goal = Vec2::new(field.half_length, aim);
    let direction = (goal - puck.pos).normalize();
    let guess = puck.pos - field.contact() * direction;
    let speed = speed.unwrap_or_else(|| {
        let room = room_behind(field, guess, direction);
        let swing = scene
            .arm
            .strike_speed(field.to_base(guess), direction, side);
        swing.min((RUN_ACCELERATION * room).sqrt())
    });
    let (normal, struck) = strike_towards(&puck, direction, speed, field.contact());
    let mallet = puck.pos - field.contact() * normal;
    if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 || mallet.x > -0.25 {
        return None;
    }
    let chance = chance(field, scene.opponent, scene.time + left, &struck, aim) - IMPATIENCE * left;
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

/// The chance that the struck puck passes the opponent and enters the goal.
fn chance(field: &Field, opponent: Option<&Opponent>, time: f64, struck: &Puck, aim: f64) -> f64 {
    let way = Vec2::new(field.half_length, aim) - struck.pos;
    let length = way.norm();
    let share = DRAG * length / struck.vel.norm().max(1e-3);
    if share > 0.9 {
        return 0.0;
    }
    let flight = -(1.0 - share).ln() / DRAG;
    // The air flow pushes with a random, correlated acceleration proportional to the speed; twice
    // integrated over the flight this is its spread across the way. Aiming errors add to it.
    let tau = FLOW_TIME;
    let integral = 2.0 * tau * flight.powi(3) / 3.0 - (tau * flight).powi(2) + 2.0 * tau.powi(4)
        - 2.0 * tau.powi(3) * (flight + tau) * (-flight / tau).exp();
    let spread =
        (FLOW_PER_SPEED * length / flight * integral.max(0.0).sqrt()).hypot(AIM_ERROR * length);
    let within = |lo: f64, hi: f64| {
        if hi <= lo {
            0.0
        } else {
            normal_cdf((hi - aim) / spread) - normal_cdf((lo - aim) / spread)
        }
    };
    let half = field.half_goal - 0.7 * field.puck;
    let open = within(-half, half);
    let Some(opponent) = opponent else {
        return open;
    };
    let arrival = time + flight * (1.0 - (field.half_length - opponent.x()) / length);
    let y = opponent.y_at(arrival);
    let block = field.contact() + 0.005;
    open - within((y - block).max(-half), (y + block).min(half))
}
