//! Striking the puck at the other goal: one line through puck and goal, one motion along it.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::{Pace, Target};
use striker::scene::{Order, Scene, around, lean};

/// Speed of the mallet at the contact, m/s.
const SPEED: f64 = 0.84;
/// Length of the run-up, metres.
const RUN_UP: f64 = 0.14;
/// The mallet is behind the puck when it is this near to the start of the run-up, metres.
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

    /// True while a strike must not be interrupted.
    pub fn committed(&self) -> bool {
        matches!(self.phase, Phase::Strike { .. } | Phase::Stop { .. })
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
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
                Order::new(target, Posture::Ready(lean(pos)))
            }
        }
    }

    fn approach(&mut self, scene: &Scene<'_>) -> Order {
        let field = scene.field;
        let goal = Vec2::new(field.half_length, 0.0);
        // Where it will be struck, if the run-up begins now.
        let time = 2.0 * RUN_UP / SPEED;
        let mut puck = scene.puck;
        puck.advance(field, time);
        let direction = (goal - puck.pos).normalize();
        let mallet = puck.pos - field.contact() * direction;
        let start = field.clamp_mallet(mallet - RUN_UP * direction);
        let goal = around(scene, start, field.contact() + 0.015);
        if goal == start && (scene.mallet.pos - start).norm() < BEHIND {
            self.phase = Phase::Strike {
                contact: scene.time + 2.0 * (mallet - start).norm().max(0.02) / SPEED,
                mallet: field.clamp_mallet(mallet),
                velocity: SPEED * direction,
            };
        }
        let mut order = Order::stop(scene, goal, Pace::QUICK);
        order.posture = Posture::Ready(lean(start));
        order
    }

    fn strike(&mut self, scene: &Scene<'_>, contact: f64, mallet: Vec2, velocity: Vec2) -> Order {
        let left = contact - scene.time;
        if left < 0.5 * scene.dt {
            let pos = scene.mallet.pos + 0.5 * STOP_TIME * scene.mallet.vel;
            self.phase = Phase::Stop {
                until: scene.time + STOP_TIME,
                pos: scene.field.clamp_mallet(pos),
            };
            return Order::coast(scene, scene.mallet.vel, Posture::Free);
        }
        let mut order = Order::new(
            Target {
                pos: mallet,
                vel: velocity,
                time: left,
            },
            Posture::Strike(lean(mallet)),
        );
        order.acceleration = 30.0;
        order
    }
}
