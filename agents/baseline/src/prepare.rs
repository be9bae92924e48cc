//! Moves a puck off the rim: simulates pushes from all sides with the puck model, and makes the best one.

use striker::arm::Posture;
use striker::field::{Field, Vec2};
use striker::motion::{Pace, Target};
use striker::puck::Puck;
use striker::scene::{MalletCommand, Scene, waypoint};

use crate::guard::guard;

/// Number of directions of a push.
const DIRECTIONS: usize = 8;
/// Speed of the mallet in a push, m/s.
const SPEED: f64 = 0.5;
/// Prediction horizon of a pushed puck, seconds.
const HORIZON: f64 = 4.0;
/// A puck slower than this may be pushed, m/s.
const SLOW: f64 = 0.06;
/// |y| and range of x in which the puck is well placed, metres.
const GOOD_Y: f64 = 0.37;
const GOOD_X: (f64, f64) = (-0.76, -0.24);
/// Time of the run-up, seconds.
const RUN_UP_TIME: f64 = 0.25;
/// Waiting time between two pushes, seconds.
const WATCH_TIME: f64 = 0.3;
/// Time for the mallet to stop after the push, seconds.
const STOP_TIME: f64 = 0.12;

#[derive(Debug, Clone, Copy)]
enum Phase {
    Look,
    Approach {
        normal: Vec2,
        puck: Vec2,
    },
    Run {
        normal: Vec2,
        mallet: Vec2,
        contact: f64,
    },
    Away {
        until: f64,
    },
}

#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
}

impl Prepare {
    pub fn new() -> Self {
        Self { phase: Phase::Look }
    }

    /// Whether a push is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Run { .. } | Phase::Away { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Look => self.look(scene),
            Phase::Approach { normal, puck } => self.approach(scene, normal, puck),
            Phase::Run {
                normal,
                mallet,
                contact,
            } => self.run(scene, normal, mallet, contact),
            Phase::Away { until } => {
                if scene.time > until {
                    self.phase = Phase::Look;
                }
                guard(scene)
            }
        }
    }

    fn look(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let puck = &scene.puck;
        if puck.vel.norm() < SLOW
            && !is_well_placed(puck)
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
            self.phase = Phase::Look;
            return guard(scene);
        }
        let mallet = scene.puck.pos - field.contact() * normal;
        let start = field.clamp_mallet(mallet - 0.5 * RUN_UP_TIME * SPEED * normal);
        let way = waypoint(scene, start, field.contact() + 0.015);
        if way == start
            && (scene.mallet.pos - start).norm() < 0.012
            && scene.mallet.vel.norm() < 0.1
        {
            self.phase = Phase::Run {
                normal,
                mallet,
                contact: scene.time + RUN_UP_TIME,
            };
        }
        let near = (scene.mallet.pos - start).norm() < 0.15;
        MalletCommand::stop(scene, way, if near { Pace::CALM } else { Pace::QUICK })
    }

    fn run(
        &mut self,
        scene: &Scene<'_>,
        normal: Vec2,
        mallet: Vec2,
        contact: f64,
    ) -> MalletCommand {
        let left = contact - scene.time;
        if left > 0.5 * scene.dt {
            let target = Target {
                pos: mallet,
                vel: SPEED * normal,
                time: left,
            };
            return MalletCommand::new(target, Posture::Free);
        }
        let rest = STOP_TIME + left;
        if rest < scene.dt {
            self.phase = Phase::Away {
                until: scene.time + WATCH_TIME,
            };
            return guard(scene);
        }
        let target = Target {
            pos: scene.mallet.pos + 0.5 * rest * scene.mallet.vel,
            vel: Vec2::zeros(),
            time: rest,
        };
        MalletCommand::new(target, Posture::Free)
    }
}

fn is_well_placed(puck: &Puck) -> bool {
    let p = puck.pos;
    p.y.abs() < GOOD_Y && p.x > GOOD_X.0 && p.x < GOOD_X.1
}

/// The direction, mallet to puck, of the push with the highest value; `None` if no push is possible.
fn best_push(field: &Field, puck: &Puck) -> Option<Vec2> {
    let mut best: Option<(Vec2, f64)> = None;
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
        let normal = Vec2::new(angle.cos(), angle.sin());
        let mallet = puck.pos - field.contact() * normal;
        if (mallet - field.clamp_mallet(mallet)).norm() > 1e-9 {
            continue;
        }
        let value = push_value(field, *puck, mallet, SPEED * normal);
        if best.is_none_or(|(_, v)| value > v) {
            best = Some((normal, value));
        }
    }
    best.map(|(normal, _)| normal)
}

/// Value of a push: up to 1 if the puck crosses the middle line in the target range, less the farther it ends.
fn push_value(field: &Field, mut puck: Puck, mallet: Vec2, velocity: Vec2) -> f64 {
    puck.strike(mallet, velocity);
    let side = puck.pos.y.signum();
    let mut time = 0.0;
    while time < HORIZON {
        if !puck.advance(field, 0.05) || puck.pos.x > -0.05 {
            return -1.0;
        }
        time += 0.05;
        if side * puck.pos.y < 0.01 {
            let margin = (puck.pos.x - GOOD_X.0)
                .min(GOOD_X.1 - puck.pos.x)
                .clamp(0.0, 0.1);
            let slow = (0.08 - puck.vel.x).clamp(0.0, 0.08);
            return 10.0 * margin.min(slow + 0.02);
        }
    }
    let x_miss = (GOOD_X.0 - puck.pos.x).max(puck.pos.x - GOOD_X.1).max(0.0);
    0.5 - puck.pos.y.abs() - x_miss
}
