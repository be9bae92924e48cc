//! Strikes the puck at the opponent's goal: one line through puck and goal, one motion along it.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::{Pace, Target};
use striker::scene::{MalletCommand, Scene, lean_side, waypoint};

/// Speed of the mallet at the contact, m/s.
const SPEED: f64 = 0.84;
/// Length of the run-up, metres.
const RUN_UP: f64 = 0.14;
/// The strike begins when the mallet is this close to the start of the run-up, metres.
const BEHIND: f64 = 0.01;
/// Time for the mallet to stop after the contact, seconds.
const STOP_TIME: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
enum Phase {
    Approach,
    Strike {
        contact: f64,
        mallet: Vec2,
        velocity: Vec2,
    },
    Stop {
        until: f64,
        pos: Vec2,
    },
}

#[derive(Debug, Clone)]
pub struct Hit {
    phase: Phase,
}

impl Hit {
    pub fn new() -> Self {
        Self {
            phase: Phase::Approach,
        }
    }

    /// Whether a strike is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Strike { .. } | Phase::Stop { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Approach => self.approach(scene),
            Phase::Strike {
                contact,
                mallet,
                velocity,
            } => self.strike(scene, contact, mallet, velocity),
            Phase::Stop { until, pos } => {
                let left = until - scene.time;
                if left < scene.dt {
                    self.phase = Phase::Approach;
                }
                let target = Target {
                    pos,
                    vel: Vec2::zeros(),
                    time: left.max(scene.dt),
                };
                MalletCommand::new(target, Posture::Ready(lean_side(pos)))
            }
        }
    }

    fn approach(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let field = scene.field;
        let goal = Vec2::new(field.half_length, 0.0);
        // Position of the puck at contact if the run-up begins now.
        let time = 2.0 * RUN_UP / SPEED;
        let mut puck = scene.puck;
        puck.advance(field, time);
        let direction = (goal - puck.pos).normalize();
        let mallet = puck.pos - field.contact() * direction;
        let start = field.clamp_mallet(mallet - RUN_UP * direction);
        let goal = waypoint(scene, start, field.contact() + 0.015);
        if goal == start && (scene.mallet.pos - start).norm() < BEHIND {
            self.phase = Phase::Strike {
                contact: scene.time + 2.0 * (mallet - start).norm().max(0.02) / SPEED,
                mallet: field.clamp_mallet(mallet),
                velocity: SPEED * direction,
            };
        }
        let mut command = MalletCommand::stop(scene, goal, Pace::QUICK);
        command.posture = Posture::Ready(lean_side(start));
        command
    }

    fn strike(
        &mut self,
        scene: &Scene<'_>,
        contact: f64,
        mallet: Vec2,
        velocity: Vec2,
    ) -> MalletCommand {
        let left = contact - scene.time;
        if left < 0.5 * scene.dt {
            let pos = scene.mallet.pos + 0.5 * STOP_TIME * scene.mallet.vel;
            self.phase = Phase::Stop {
                until: scene.time + STOP_TIME,
                pos: scene.field.clamp_mallet(pos),
            };
            return MalletCommand::coast(scene, scene.mallet.vel, Posture::Free);
        }
        let mut command = MalletCommand::new(
            Target {
                pos: mallet,
                vel: velocity,
                time: left,
            },
            Posture::Strike(lean_side(mallet)),
        );
        command.acceleration = 30.0;
        command
    }
}
