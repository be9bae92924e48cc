//! Strikes the puck at the opponent's goal: one line through puck and goal, one motion along it.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::{Pace, Target};
use striker::scene::{MalletCommand, Scene, elbow_side, waypoint};

/// Speed of the mallet at the contact, m/s.
const STRIKE_SPEED: f64 = 0.84;
/// Length of the run-up, metres.
const RUN_UP_LENGTH: f64 = 0.14;
/// Largest acceleration of the mallet in a strike, m/s².
const STRIKE_ACCELERATION: f64 = 30.0;
/// The strike begins when the mallet is this close to the start of the run-up, metres.
const START_TOLERANCE: f64 = 0.01;
/// Time for the mallet to stop after the contact, seconds.
const STOP_TIME: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
enum Phase {
    /// Moves to the start of the run-up.
    Approach,
    /// Accelerates until the contact. Times are in seconds since the episode's start.
    Strike {
        contact_time: f64,
        /// Position of the mallet at contact.
        mallet: Vec2,
        /// Velocity of the mallet at contact.
        velocity: Vec2,
    },
    /// Comes to rest at `pos` at the time `end_time`.
    Stop { end_time: f64, pos: Vec2 },
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
                contact_time,
                mallet,
                velocity,
            } => self.strike(scene, contact_time, mallet, velocity),
            Phase::Stop { end_time, pos } => {
                let time_left = end_time - scene.time;
                if time_left < scene.dt {
                    self.phase = Phase::Approach;
                }
                let target = Target {
                    pos,
                    vel: Vec2::zeros(),
                    time: time_left.max(scene.dt),
                };
                MalletCommand::new(target, Posture::Ready(elbow_side(pos)))
            }
        }
    }

    fn approach(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let field = scene.field;
        let goal = Vec2::new(field.half_length, 0.0);
        // The mallet accelerates evenly from rest, so its mean speed in the run-up is half of the strike's.
        let run_up_time = 2.0 * RUN_UP_LENGTH / STRIKE_SPEED;
        // The puck at contact if the run-up begins now.
        let mut puck = scene.puck;
        puck.advance(field, run_up_time);
        let direction = (goal - puck.pos).normalize();
        let mallet = puck.pos - field.contact_distance() * direction;
        let start = field.clamp_mallet(mallet - RUN_UP_LENGTH * direction);
        let next_point = waypoint(scene, start, field.contact_distance() + 0.015);
        if next_point == start && (scene.mallet.pos - start).norm() < START_TOLERANCE {
            self.phase = Phase::Strike {
                contact_time: scene.time + 2.0 * (mallet - start).norm().max(0.02) / STRIKE_SPEED,
                mallet: field.clamp_mallet(mallet),
                velocity: STRIKE_SPEED * direction,
            };
        }
        let mut command = MalletCommand::stop(scene, next_point, Pace::QUICK);
        command.posture = Posture::Ready(elbow_side(start));
        command
    }

    fn strike(
        &mut self,
        scene: &Scene<'_>,
        contact_time: f64,
        mallet: Vec2,
        velocity: Vec2,
    ) -> MalletCommand {
        let time_left = contact_time - scene.time;
        if time_left < 0.5 * scene.dt {
            let pos = scene.mallet.pos + 0.5 * STOP_TIME * scene.mallet.vel;
            self.phase = Phase::Stop {
                end_time: scene.time + STOP_TIME,
                pos: scene.field.clamp_mallet(pos),
            };
            return MalletCommand::coast(scene, scene.mallet.vel, Posture::Any);
        }
        let mut command = MalletCommand::new(
            Target {
                pos: mallet,
                vel: velocity,
                time: time_left,
            },
            Posture::Strike(elbow_side(mallet)),
        );
        command.acceleration = STRIKE_ACCELERATION;
        command
    }
}
