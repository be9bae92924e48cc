//! Moves a puck from the rim to an area from which it can be shot.
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
const CALM_PUCK: f64 = 0.1;
/// A rolling puck with a lower expected value than this is stopped.
const MIN_PROSPECT: f64 = 0.2;
/// Planning lead of strikes, about the time of the approach, seconds.
const LEAD: f64 = 0.9;
/// A puck this far from its expected position requires a new plan, metres.
const MISPLACED: f64 = 0.03;
/// Contact normals evaluated per control step.
const PER_STEP: usize = 2;

#[derive(Debug, Clone, Copy)]
enum Phase {
    Search { next: usize, best: Option<Strike> },
    Approach { strike: Strike, puck: Vec2 },
    Run { strike: Strike, contact: f64 },
    Retreat { until: f64 },
}

#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
    /// Stops a puck that rolls in a bad direction.
    absorb: Absorb,
}

impl Prepare {
    pub fn new() -> Self {
        Self {
            phase: Phase::Search {
                next: 0,
                best: None,
            },
            absorb: Absorb::new(0.05),
        }
    }

    /// Whether a strike is running that must not be interrupted.
    pub fn is_committed(&self) -> bool {
        matches!(self.phase, Phase::Run { .. } | Phase::Retreat { .. })
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        match self.phase {
            Phase::Search { next, best } => self.search(scene, next, best),
            Phase::Approach { strike, puck } => self.approach(scene, strike, puck),
            Phase::Run { strike, contact } => self.run(scene, strike, contact),
            Phase::Retreat { until } => {
                if scene.time > until {
                    self.phase = Phase::Search {
                        next: 0,
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
        next: usize,
        mut best: Option<Strike>,
    ) -> MalletCommand {
        let puck = &scene.puck;
        let moving = puck.vel.norm() > CALM_PUCK || scene.puck_speed_deviation.norm() > 0.05;
        if moving || is_prepared(puck) {
            self.phase = Phase::Search {
                next: 0,
                best: None,
            };
            if moving
                && slide_value(scene.field, *puck) < MIN_PROSPECT
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
        expected.advance(scene.field, LEAD);
        for k in next..(next + PER_STEP).min(NORMALS) {
            try_normal(scene.field, &expected, k, &mut best);
        }
        self.phase = match best {
            Some(strike) if next + PER_STEP >= NORMALS => Phase::Approach {
                strike,
                puck: expected.pos,
            },
            None if next + PER_STEP >= NORMALS => Phase::Search {
                next: 0,
                best: None,
            },
            _ => Phase::Search {
                next: next + PER_STEP,
                best,
            },
        };
        retreat(scene)
    }

    fn approach(&mut self, scene: &Scene<'_>, strike: Strike, planned: Vec2) -> MalletCommand {
        let field = scene.field;
        let mut expected = scene.puck;
        expected.advance(field, 0.5 * LEAD);
        if scene.puck.vel.norm() > 1.5 * CALM_PUCK || (expected.pos - planned).norm() > MISPLACED {
            self.phase = Phase::Search {
                next: 0,
                best: None,
            };
            return retreat(scene);
        }
        let mut there = scene.puck;
        there.advance(
            field,
            run_up(&strike.velocity).norm() * 2.0 / strike.velocity.norm(),
        );
        let contact = there.pos - field.contact() * strike.normal;
        let start = field.clamp_mallet(contact - run_up(&strike.velocity));
        let way = waypoint(scene, start, field.contact() + 0.012);
        let distance = (scene.mallet.pos - start).norm();
        if way == start && distance < 0.004 && scene.mallet.vel.norm() < 0.05 {
            let time = 2.0 * (contact - start).norm() / strike.velocity.norm();
            self.phase = Phase::Run {
                strike,
                contact: scene.time + time.max(2.0 * scene.dt),
            };
        }
        // Fast at a distance, slow beside the puck.
        MalletCommand::stop(
            scene,
            way,
            if distance > 0.15 {
                Pace::QUICK
            } else {
                Pace::CALM
            },
        )
    }

    fn run(&mut self, scene: &Scene<'_>, strike: Strike, contact: f64) -> MalletCommand {
        let left = contact - scene.time;
        if left <= 0.5 * scene.dt {
            // Brake at once; the puck leaves faster than the mallet.
            let time = 2.0 * strike.velocity.norm() / BRAKE;
            if -left >= time {
                self.phase = Phase::Retreat {
                    until: scene.time + 0.25,
                };
                return retreat(scene);
            }
            let rest = (time + left).max(scene.dt);
            let pos = scene.mallet.pos + 0.5 * rest * scene.mallet.vel;
            return MalletCommand::new(
                Target {
                    pos,
                    vel: Vec2::zeros(),
                    time: rest,
                },
                Posture::Free,
            );
        }
        let mut there = scene.puck;
        there.advance(scene.field, left);
        let pos = there.pos - scene.field.contact() * strike.normal;
        MalletCommand::new(
            Target {
                pos,
                vel: strike.velocity,
                time: left,
            },
            Posture::Free,
        )
    }
}

/// Keeps clear of the puck: to the other half along y, in front of the goal.
fn retreat(scene: &Scene<'_>) -> MalletCommand {
    let y = if scene.puck.pos.y > 0.0 { -0.12 } else { 0.12 };
    let pos = Vec2::new(-0.8, y);
    MalletCommand::stop(
        scene,
        waypoint(scene, pos, scene.field.contact() + 0.03),
        Pace::QUICK,
    )
}
