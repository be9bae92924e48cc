//! Moves a puck from the table's rim to an area from which it can be shot: the puck is then *prepared*.
//!
//! The mallet does not fit between puck and rim, so the puck must leave the rim by a bounce. Many
//! strikes are simulated with the puck model, the promising ones with variations of uncertain
//! parameters, and the most robust one is carried out. The search is spread over control steps to
//! keep each of them short.

mod strike;

use super::absorb::Absorb;
use crate::arm::Posture;
use crate::field::Vec2;
use crate::motion::{Pace, Target};
use crate::scene::{MalletCommand, Scene, waypoint};
use strike::{BRAKE, NORMALS, Strike, is_prepared, run_up, slide_value, try_normal};

/// Puck speed below which a strike may be planned, m/s.
const CALM_PUCK_SPEED: f64 = 0.1;
/// A moving puck is stopped if the place to which it slides has a lower value. Values are from 0, a failure, to 1, a prepared puck.
const MIN_VALUE: f64 = 0.2;
/// A strike is planned for the puck's position this much later, about the time of the approach, seconds.
const LEAD_TIME: f64 = 0.9;
/// A puck this far from its expected position requires a new plan, metres.
const PUCK_TOLERANCE: f64 = 0.03;
/// Contact normals (directions from mallet to puck) evaluated per control step.
const NORMALS_PER_STEP: usize = 2;

/// A puck closer to the table's long axis than this |y| is not stopped, because crossing the axis ends the episode, metres.
const MIN_AXIS_DISTANCE: f64 = 0.05;
/// Time of the retreat after a strike, seconds. Meanwhile the estimate of the puck's motion becomes certain.
const RETREAT_TIME: f64 = 0.25;

#[derive(Debug, Clone, Copy)]
enum Phase {
    /// Evaluates contact normals, `next_normal` being the index of the next one; `best` is the best strike so far.
    Search {
        next_normal: usize,
        best: Option<Strike>,
    },
    /// Moves to the start of the run-up. `puck` is the position for which the strike is planned.
    Approach { strike: Strike, puck: Vec2 },
    /// Accelerates, strikes and brakes. Times are in seconds since the episode's start.
    Strike { strike: Strike, contact_time: f64 },
    /// Keeps clear of the puck until `end_time`.
    Retreat { end_time: f64 },
}

#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
    /// Stops a puck that slides in a bad direction.
    absorb: Absorb,
}

impl Prepare {
    pub fn new() -> Self {
        Self {
            phase: Phase::Search {
                next_normal: 0,
                best: None,
            },
            absorb: Absorb::new(MIN_AXIS_DISTANCE),
        }
    }

    /// Whether a strike is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Strike { .. } | Phase::Retreat { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Search { next_normal, best } => self.search(scene, next_normal, best),
            Phase::Approach { strike, puck } => self.approach(scene, strike, puck),
            Phase::Strike {
                strike,
                contact_time,
            } => self.strike(scene, strike, contact_time),
            Phase::Retreat { end_time } => {
                if scene.time > end_time {
                    self.phase = Phase::Search {
                        next_normal: 0,
                        best: None,
                    };
                }
                retreat(scene)
            }
        }
    }

    fn search(
        &mut self,
        scene: &Scene<'_>,
        next_normal: usize,
        mut best: Option<Strike>,
    ) -> MalletCommand {
        let puck = &scene.puck;
        let moving =
            puck.vel.norm() > CALM_PUCK_SPEED || scene.puck_velocity_deviation.norm() > 0.05;
        if moving || is_prepared(puck) {
            self.phase = Phase::Search {
                next_normal: 0,
                best: None,
            };
            if moving
                && slide_value(scene.field, *puck) < MIN_VALUE
                && let Some(command) = self.absorb.decide(scene)
            {
                return command;
            }
            return if self.absorb.cancel(scene) {
                retreat(scene)
            } else {
                self.absorb.decide(scene).unwrap_or_else(|| retreat(scene))
            };
        }
        let mut expected = *puck;
        expected.advance(scene.field, LEAD_TIME);
        for k in next_normal..(next_normal + NORMALS_PER_STEP).min(NORMALS) {
            try_normal(scene.field, &expected, k, &mut best);
        }
        self.phase = match best {
            Some(strike) if next_normal + NORMALS_PER_STEP >= NORMALS => Phase::Approach {
                strike,
                puck: expected.pos,
            },
            None if next_normal + NORMALS_PER_STEP >= NORMALS => Phase::Search {
                next_normal: 0,
                best: None,
            },
            _ => Phase::Search {
                next_normal: next_normal + NORMALS_PER_STEP,
                best,
            },
        };
        retreat(scene)
    }

    fn approach(&mut self, scene: &Scene<'_>, strike: Strike, planned: Vec2) -> MalletCommand {
        let field = scene.field;
        let mut expected = scene.puck;
        expected.advance(field, 0.5 * LEAD_TIME);
        if scene.puck.vel.norm() > 1.5 * CALM_PUCK_SPEED
            || (expected.pos - planned).norm() > PUCK_TOLERANCE
        {
            self.phase = Phase::Search {
                next_normal: 0,
                best: None,
            };
            return retreat(scene);
        }
        let mut puck_at_contact = scene.puck;
        puck_at_contact.advance(
            field,
            run_up(&strike.velocity).norm() * 2.0 / strike.velocity.norm(),
        );
        let contact = puck_at_contact.pos - field.contact_distance() * strike.normal;
        let start = field.clamp_mallet(contact - run_up(&strike.velocity));
        let next_point = waypoint(scene, start, field.contact_distance() + 0.012);
        let distance = (scene.mallet.pos - start).norm();
        if next_point == start && distance < 0.004 && scene.mallet.vel.norm() < 0.05 {
            let time = 2.0 * (contact - start).norm() / strike.velocity.norm();
            self.phase = Phase::Strike {
                strike,
                contact_time: scene.time + time.max(2.0 * scene.dt),
            };
        }
        // Fast at a distance, slow beside the puck.
        MalletCommand::stop(
            scene,
            next_point,
            if distance > 0.15 {
                Pace::QUICK
            } else {
                Pace::CALM
            },
        )
    }

    fn strike(&mut self, scene: &Scene<'_>, strike: Strike, contact_time: f64) -> MalletCommand {
        let time_left = contact_time - scene.time;
        if time_left <= 0.5 * scene.dt {
            // Brake at once; the puck leaves faster than the mallet.
            let time = 2.0 * strike.velocity.norm() / BRAKE;
            if -time_left >= time {
                self.phase = Phase::Retreat {
                    end_time: scene.time + RETREAT_TIME,
                };
                return retreat(scene);
            }
            let braking_left = (time + time_left).max(scene.dt);
            let pos = scene.mallet.pos + 0.5 * braking_left * scene.mallet.vel;
            return MalletCommand::new(
                Target {
                    pos,
                    vel: Vec2::zeros(),
                    time: braking_left,
                },
                Posture::Any,
            );
        }
        let mut puck_at_contact = scene.puck;
        puck_at_contact.advance(scene.field, time_left);
        let pos = puck_at_contact.pos - scene.field.contact_distance() * strike.normal;
        MalletCommand::new(
            Target {
                pos,
                vel: strike.velocity,
                time: time_left,
            },
            Posture::Any,
        )
    }
}

/// Moves away from the puck: to a point in front of the goal, on the other side of the long axis.
fn retreat(scene: &Scene<'_>) -> MalletCommand {
    let y = if scene.puck.pos.y > 0.0 { -0.12 } else { 0.12 };
    let pos = Vec2::new(-0.8, y);
    MalletCommand::stop(
        scene,
        waypoint(scene, pos, scene.field.contact_distance() + 0.03),
        Pace::QUICK,
    )
}
