//! Moves a puck off the table's rim to a place from which it can be shot: simulates pushes from all sides with the puck model, and makes
//! the best one.

use striker::arm::Posture;
use striker::field::{Field, Vec2};
use striker::motion::{Pace, Target};
use striker::puck::Puck;
use striker::scene::{MalletCommand, Scene, waypoint};

use crate::guard::guard;

/// Number of compared directions of a push.
const DIRECTIONS: usize = 8;
/// Speed of the mallet in a push, m/s.
const PUSH_SPEED: f64 = 0.5;
/// Prediction horizon of a pushed puck, seconds.
const HORIZON: f64 = 4.0;
/// A puck slower than this may be pushed, m/s.
const SLOW_PUCK_SPEED: f64 = 0.06;
/// Largest |y| and range of x at which the puck can be shot, metres.
const PREPARED_Y: f64 = 0.37;
const PREPARED_X: (f64, f64) = (-0.76, -0.24);
/// Time of the run-up, seconds.
const RUN_UP_TIME: f64 = 0.25;
/// Waiting time between two pushes, seconds.
const WATCH_TIME: f64 = 0.3;
/// Time for the mallet to stop after the push, seconds.
const STOP_TIME: f64 = 0.12;

#[derive(Debug, Clone, Copy)]
enum Phase {
    /// Waits in front of the goal until a push is possible.
    Wait,
    /// Moves to the start of the run-up. `normal` points from mallet to puck at the contact; `puck` is the planned position.
    Approach { normal: Vec2, puck: Vec2 },
    /// Accelerates to the contact, and brakes after it. Times are in seconds since the episode's start.
    Push {
        normal: Vec2,
        mallet_at_contact: Vec2,
        contact_time: f64,
    },
    /// Returns to the front of the goal, and watches the puck until `end_time`.
    Retreat { end_time: f64 },
}

#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
}

impl Prepare {
    pub fn new() -> Self {
        Self { phase: Phase::Wait }
    }

    /// Whether a push is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Push { .. } | Phase::Retreat { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Wait => self.wait(scene),
            Phase::Approach { normal, puck } => self.approach(scene, normal, puck),
            Phase::Push {
                normal,
                mallet_at_contact,
                contact_time,
            } => self.push(scene, normal, mallet_at_contact, contact_time),
            Phase::Retreat { end_time } => {
                if scene.time > end_time {
                    self.phase = Phase::Wait;
                }
                guard(scene)
            }
        }
    }

    fn wait(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let puck = &scene.puck;
        if puck.vel.norm() < SLOW_PUCK_SPEED
            && !is_prepared(puck)
            && let Some(normal) = best_push(scene.field, puck)
        {
            self.phase = Phase::Approach {
                normal,
                puck: puck.pos,
            };
        }
        guard(scene)
    }

    fn approach(&mut self, scene: &Scene<'_>, normal: Vec2, planned: Vec2) -> MalletCommand {
        let field = scene.field;
        if (scene.puck.pos - planned).norm() > 0.03 {
            self.phase = Phase::Wait;
            return guard(scene);
        }
        let mallet = scene.puck.pos - field.contact_distance() * normal;
        let start = field.clamp_mallet(mallet - 0.5 * RUN_UP_TIME * PUSH_SPEED * normal);
        let next_point = waypoint(scene, start, field.contact_distance() + 0.015);
        if next_point == start
            && (scene.mallet.pos - start).norm() < 0.012
            && scene.mallet.vel.norm() < 0.1
        {
            self.phase = Phase::Push {
                normal,
                mallet_at_contact: mallet,
                contact_time: scene.time + RUN_UP_TIME,
            };
        }
        let is_near_start = (scene.mallet.pos - start).norm() < 0.15;
        MalletCommand::stop(
            scene,
            next_point,
            if is_near_start {
                Pace::CALM
            } else {
                Pace::QUICK
            },
        )
    }

    fn push(
        &mut self,
        scene: &Scene<'_>,
        normal: Vec2,
        mallet_at_contact: Vec2,
        contact_time: f64,
    ) -> MalletCommand {
        let time_left = contact_time - scene.time;
        if time_left > 0.5 * scene.dt {
            let target = Target {
                pos: mallet_at_contact,
                vel: PUSH_SPEED * normal,
                time: time_left,
            };
            return MalletCommand::new(target, Posture::Any);
        }
        let braking_left = STOP_TIME + time_left;
        if braking_left < scene.dt {
            self.phase = Phase::Retreat {
                end_time: scene.time + WATCH_TIME,
            };
            return guard(scene);
        }
        let target = Target {
            pos: scene.mallet.pos + 0.5 * braking_left * scene.mallet.vel,
            vel: Vec2::zeros(),
            time: braking_left,
        };
        MalletCommand::new(target, Posture::Any)
    }
}

fn is_prepared(puck: &Puck) -> bool {
    let pos = puck.pos;
    pos.y.abs() < PREPARED_Y && pos.x > PREPARED_X.0 && pos.x < PREPARED_X.1
}

/// The direction, mallet to puck, of the push with the highest value; `None` if no push is possible.
fn best_push(field: &Field, puck: &Puck) -> Option<Vec2> {
    let mut best: Option<(Vec2, f64)> = None;
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
        let normal = Vec2::new(angle.cos(), angle.sin());
        let mallet = puck.pos - field.contact_distance() * normal;
        if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
            continue;
        }
        let value = push_value(field, *puck, mallet, PUSH_SPEED * normal);
        if best.is_none_or(|(_, best_value)| value > best_value) {
            best = Some((normal, value));
        }
    }
    best.map(|(normal, _)| normal)
}

/// Value of a push, from −1, if the puck leaves the own half, to 1, if it crosses the table's long axis slowly and well inside the target
/// range. A puck that does not cross it counts less the farther from the axis it ends.
fn push_value(field: &Field, mut puck: Puck, mallet: Vec2, velocity: Vec2) -> f64 {
    puck.strike(mallet, velocity);
    let side = puck.pos.y.signum();
    let mut time = 0.0;
    while time < HORIZON {
        if !puck.advance(field, 0.05) || puck.pos.x > -0.05 {
            return -1.0;
        }
        time += 0.05;
        // Crossing the long axis ends the task.
        if side * puck.pos.y < 0.01 {
            let margin = (puck.pos.x - PREPARED_X.0)
                .min(PREPARED_X.1 - puck.pos.x)
                .clamp(0.0, 0.1);
            let slowness = (0.08 - puck.vel.x).clamp(0.0, 0.08);
            return 10.0 * margin.min(slowness + 0.02);
        }
    }
    let x_miss = (PREPARED_X.0 - puck.pos.x)
        .max(puck.pos.x - PREPARED_X.1)
        .max(0.0);
    0.5 - puck.pos.y.abs() - x_miss
}
