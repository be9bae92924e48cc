//! Strikes the puck at the opponent's goal.
//!
//! Contact times over the next seconds are compared by the chance of a goal: the air flow disturbs a
//! faster shot less, a shorter way is better, and the opponent must not be in the way. The mallet
//! waits behind the predicted contact and then accelerates along the line of the shot so that it
//! arrives at full speed at the chosen time.

mod plan;
mod shot;

use super::Prepare;
use crate::arm::Posture;
use crate::field::Vec2;
use crate::keeper::Keeper;
use crate::motion::{Pace, Target};
use crate::scene::{MalletCommand, Scene, lean_side, waypoint};
use plan::{
    NUDGE_THRESHOLD, NUDGE_THRESHOLD_IN_GAME, Plan, best_nudge, best_plan, refresh, replan,
};

/// A plan is replaced only by one whose chance of a goal is higher by this much.
const SWITCH_MARGIN: f64 = 0.06;
/// Maximum number of nudges per episode.
const NUDGES_MAX: u32 = 1;
/// Largest acceleration of a strike, m/s².
const STRIKE_ACCELERATION: f64 = 45.0;
/// Largest acceleration of a nudge, m/s².
const NUDGE_ACCELERATION: f64 = 14.0;
/// The contact is no longer corrected this long before it, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A puck out of reach and slower than this will stay out of reach, m/s.
const STILL: f64 = 0.08;

/// Position and time at which the mallet comes to rest after a strike.
#[derive(Debug, Clone, Copy)]
struct Stop {
    pos: Vec2,
    time: f64,
}

impl Stop {
    fn plan(scene: &Scene<'_>) -> Self {
        let motion = scene.mallet;
        let speed = motion.vel.norm().max(1e-3);
        let desired = motion.pos + 0.5 * (0.08 + 0.14 * speed) * motion.vel;
        let pos = scene.field.clamp_mallet(desired);
        // A quintic to rest decelerates evenly if it covers half of speed × time.
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
    /// `through`: end of the phase at full speed; `rest`: waiting time after stopping, seconds.
    Follow {
        through: f64,
        stop: Option<Stop>,
        rest: f64,
    },
}

#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
    /// Frees a puck that cannot be struck at its position.
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

    /// Whether a strike is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Swing(_) | Phase::Follow { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
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

    fn seek(&mut self, scene: &Scene<'_>, old: Option<Plan>) -> MalletCommand {
        if let Some(rescue) = self.rescue.as_mut().filter(|r| r.is_committed()) {
            return rescue.decide(scene);
        }
        let kept = old.and_then(|p| refresh(scene, &p));
        let mut best = best_plan(scene);
        let threshold = match scene.keeper {
            Keeper::Rival(_) => NUDGE_THRESHOLD_IN_GAME,
            Keeper::Unseen | Keeper::Pendulum(_) => NUDGE_THRESHOLD,
        };
        if self.nudges < NUDGES_MAX && best.is_some_and(|b| b.chance < threshold) {
            best = best_nudge(scene).or(best);
        }
        let plan = match (kept, best) {
            (Some(k), Some(b)) if b.chance > k.chance + SWITCH_MARGIN => Some(b),
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
            return MalletCommand::stop(
                scene,
                waypoint(scene, behind, scene.field.contact() + 0.015),
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
        let goal = waypoint(scene, start, scene.field.contact() + 0.015);
        let mut command = MalletCommand::stop(scene, goal, Pace::CALM);
        command.posture = Posture::Ready(plan.side);
        // Arrive in time, without haste.
        if goal == start {
            command.target.time = command.target.time.min((left - run_up).max(0.1));
        }
        command
    }

    fn swing(&mut self, scene: &Scene<'_>, plan: Plan) -> MalletCommand {
        let left = plan.contact_time - scene.time;
        if left <= 0.6 * scene.dt {
            // A nudged puck is followed at once; after a shot there is no hurry.
            let rest = if plan.nudge { 0.0 } else { 0.2 };
            self.nudges += u32::from(plan.nudge);
            self.phase = Phase::Follow {
                through: scene.time + 0.03,
                stop: None,
                rest,
            };
            return self.follow(scene, scene.time + 0.03, None, rest);
        }
        // Just before the contact a correction would be a jerk, and a contact already changes the estimate.
        let plan = if left > LAST_CORRECTION {
            replan(scene, &plan, left, Some(plan.speed)).unwrap_or(plan)
        } else {
            plan
        };
        self.phase = Phase::Swing(plan);
        MalletCommand {
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

    /// Continues through the contact at full speed, then stops on a fixed path, so that the
    /// deceleration is even.
    fn follow(
        &mut self,
        scene: &Scene<'_>,
        through: f64,
        stop: Option<Stop>,
        rest: f64,
    ) -> MalletCommand {
        let posture = Posture::Strike(lean_side(scene.mallet.pos));
        if scene.time < through {
            return MalletCommand::coast(scene, scene.mallet.vel, posture);
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
            return MalletCommand::stop(scene, scene.mallet.pos, Pace::CALM);
        }
        MalletCommand::new(
            Target {
                pos: stop.pos,
                vel: Vec2::zeros(),
                time: left,
            },
            Posture::Ready(lean_side(stop.pos)),
        )
    }
}
