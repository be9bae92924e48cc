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
use crate::scene::{MalletCommand, Scene, elbow_side, waypoint};
use plan::{
    NUDGE_THRESHOLD, NUDGE_THRESHOLD_IN_GAME, Plan, best_plan, earliest_nudge, refresh, replan,
};

/// A plan is replaced only by one whose chance of a goal is higher by this much.
const SWITCH_MARGIN: f64 = 0.06;
/// Maximum number of *nudges* per episode: gentle strikes that move the puck to a better position for a shot.
const NUDGES_MAX: u32 = 1;
/// Largest acceleration of a strike, m/s².
const STRIKE_ACCELERATION: f64 = 45.0;
/// Largest acceleration of a nudge, m/s².
const NUDGE_ACCELERATION: f64 = 14.0;
/// The contact is no longer corrected this long before it, seconds.
const LAST_CORRECTION: f64 = 0.05;
/// A puck out of reach and slower than this will stay out of reach, m/s.
const STOPPED_SPEED: f64 = 0.08;

/// Time for which the mallet keeps its speed after the contact, seconds.
const COAST_TIME: f64 = 0.03;

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
    /// Compares plans and moves behind the puck.
    Seek(Option<Plan>),
    /// Accelerates towards the contact.
    Swing(Plan),
    /// Moves on after the contact, then stops.
    FollowThrough {
        /// Time until which the mallet keeps its speed, seconds since the episode's start.
        coast_end: f64,
        /// Set when the mallet begins to stop.
        stop: Option<Stop>,
        /// Waiting time after stopping, seconds.
        wait_after_stop: f64,
    },
}

#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
    /// Moves a puck that cannot be struck at its position off the rim.
    freeing: Option<Prepare>,
    /// Nudges so far in this episode.
    nudges: u32,
}

impl Hit {
    pub fn new() -> Self {
        Self {
            phase: Phase::Seek(None),
            freeing: None,
            nudges: 0,
        }
    }

    /// Whether a strike is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Swing(_) | Phase::FollowThrough { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Seek(last_plan) => self.seek(scene, last_plan),
            Phase::Swing(plan) => self.swing(scene, plan),
            Phase::FollowThrough {
                coast_end,
                stop,
                wait_after_stop,
            } => self.follow_through(scene, coast_end, stop, wait_after_stop),
        }
    }

    fn seek(&mut self, scene: &Scene<'_>, last_plan: Option<Plan>) -> MalletCommand {
        if let Some(freeing) = self
            .freeing
            .as_mut()
            .filter(|prepare| prepare.is_committed())
        {
            return freeing.decide(scene);
        }
        let current = last_plan.and_then(|plan| refresh(scene, &plan));
        let mut best = best_plan(scene);
        let threshold = match scene.keeper {
            Keeper::Opponent(_) => NUDGE_THRESHOLD_IN_GAME,
            Keeper::Unseen | Keeper::Pendulum(_) => NUDGE_THRESHOLD,
        };
        if self.nudges < NUDGES_MAX && best.is_some_and(|best| best.chance < threshold) {
            best = earliest_nudge(scene).or(best);
        }
        let plan = match (current, best) {
            (Some(current), Some(best)) if best.chance > current.chance + SWITCH_MARGIN => {
                Some(best)
            }
            (Some(current), _) => Some(current),
            (None, best) => best,
        };
        self.phase = Phase::Seek(plan);
        let Some(plan) = plan else {
            if scene.puck.vel.norm() < STOPPED_SPEED && scene.puck.pos.x < -0.1 {
                return self.freeing.get_or_insert_with(Prepare::new).decide(scene);
            }
            self.freeing = None;
            let behind = Vec2::new(
                scene.field.mallet_x_min() + 0.03,
                scene.puck.pos.y.clamp(-0.12, 0.12),
            );
            return MalletCommand::stop(
                scene,
                waypoint(scene, behind, scene.field.contact_distance() + 0.015),
                Pace::CALM,
            );
        };
        self.freeing = None;
        let (start, run_up) = plan.run_up(scene.field);
        let time_left = plan.contact_time - scene.time;
        if time_left <= run_up + 0.5 * scene.dt {
            self.phase = Phase::Swing(plan);
            return self.swing(scene, plan);
        }
        let next_point = waypoint(scene, start, scene.field.contact_distance() + 0.015);
        let mut command = MalletCommand::stop(scene, next_point, Pace::CALM);
        command.posture = Posture::Ready(plan.side);
        // Arrive in time, without haste.
        if next_point == start {
            command.target.time = command.target.time.min((time_left - run_up).max(0.1));
        }
        command
    }

    fn swing(&mut self, scene: &Scene<'_>, plan: Plan) -> MalletCommand {
        let time_left = plan.contact_time - scene.time;
        if time_left <= 0.6 * scene.dt {
            // A nudged puck is followed at once; after a shot there is no hurry.
            let wait_after_stop = if plan.is_nudge { 0.0 } else { 0.2 };
            self.nudges += u32::from(plan.is_nudge);
            self.phase = Phase::FollowThrough {
                coast_end: scene.time + COAST_TIME,
                stop: None,
                wait_after_stop,
            };
            return self.follow_through(scene, scene.time + COAST_TIME, None, wait_after_stop);
        }
        // Just before the contact a correction would be a jerk. A contact that has begun already changes the puck's estimate, too.
        let plan = if time_left > LAST_CORRECTION {
            replan(scene, &plan, time_left, Some(plan.speed)).unwrap_or(plan)
        } else {
            plan
        };
        self.phase = Phase::Swing(plan);
        MalletCommand {
            target: Target {
                pos: plan.mallet,
                vel: plan.speed * plan.normal,
                time: time_left,
            },
            posture: Posture::Strike(plan.side),
            acceleration: if plan.is_nudge {
                NUDGE_ACCELERATION
            } else {
                STRIKE_ACCELERATION
            },
        }
    }

    /// Continues through the contact at full speed, then stops on a fixed path, so that the
    /// deceleration is even.
    fn follow_through(
        &mut self,
        scene: &Scene<'_>,
        coast_end: f64,
        stop: Option<Stop>,
        wait_after_stop: f64,
    ) -> MalletCommand {
        let posture = Posture::Strike(elbow_side(scene.mallet.pos));
        if scene.time < coast_end {
            return MalletCommand::coast(scene, scene.mallet.vel, posture);
        }
        let stop = stop.unwrap_or_else(|| Stop::plan(scene));
        let time_left = stop.time - scene.time;
        self.phase = if time_left < -wait_after_stop {
            Phase::Seek(None)
        } else {
            Phase::FollowThrough {
                coast_end,
                stop: Some(stop),
                wait_after_stop,
            }
        };
        if time_left < scene.dt {
            return MalletCommand::stop(scene, scene.mallet.pos, Pace::CALM);
        }
        MalletCommand::new(
            Target {
                pos: stop.pos,
                vel: Vec2::zeros(),
                time: time_left,
            },
            Posture::Ready(elbow_side(stop.pos)),
        )
    }
}
