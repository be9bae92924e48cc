//! Striking the puck at the opponent's goal.
//!
//! Contact times over the next seconds are compared by the chance of a goal: a faster shot is
//! disturbed less by the air flow, a nearer one has less far to go, and the opponent must be
//! elsewhere when it arrives. The mallet waits behind the predicted contact and then accelerates
//! along the line of the shot so that it arrives at full speed at the chosen time.

mod plan;
mod shot;

use super::Prepare;
use crate::arm::Posture;
use crate::field::Vec2;
use crate::keeper::Keeper;
use crate::motion::{Pace, Target};
use crate::scene::{Order, Scene, around, lean};
use plan::{Plan, WORTH_A_NUDGE, WORTH_A_NUDGE_IN_GAME, again, best_nudge, best_plan, refresh};

/// A running plan is given up only for one that is better by this much.
const LOYALTY: f64 = 0.06;
/// Nudges per episode.
const NUDGES_MAX: u32 = 1;
/// Largest acceleration of a strike, m/s².
const STRIKE_ACCELERATION: f64 = 45.0;
/// The same for a nudge, m/s².
const NUDGE_ACCELERATION: f64 = 14.0;
/// The contact is no longer corrected this long before it, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A puck slower than this that cannot be struck will not come into reach by itself, m/s.
const STILL: f64 = 0.08;

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

#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
    /// Frees a puck that cannot be struck where it lies.
    rescue: Option<Prepare>,
    nudges: u32,
}

impl Hit {
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
        let worth = match scene.keeper {
            Keeper::Rival(_) => WORTH_A_NUDGE_IN_GAME,
            Keeper::Nobody | Keeper::Pendulum(_) => WORTH_A_NUDGE,
        };
        if self.nudges < NUDGES_MAX && best.is_some_and(|b| b.chance < worth) {
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
            acceleration: if plan.nudge {
                NUDGE_ACCELERATION
            } else {
                STRIKE_ACCELERATION
            },
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
