//! Herding a puck from the rim to where it can be shot.
//!
//! The mallet cannot get between puck and rim, so the puck must come off the rim by a bounce. Many
//! strikes are tried against the puck model, the promising ones again with variations of what is
//! uncertain, and the one that most often ends in the goal area is carried out. The search is spread
//! over control steps to keep each of them short.

mod strike;

use super::absorb::Absorb;
use crate::arm::Posture;
use crate::field::Vec2;
use crate::motion::{Pace, Target};
use crate::scene::{Order, Scene, around};
use strike::{BRAKE, NORMALS, Strike, prepared, run_up, slide_out, try_normal};

/// Puck speed below which a strike may be planned, m/s.
const CALM_PUCK: f64 = 0.1;
/// A rolling puck whose prospects are worse than this is stopped.
const SPOILT: f64 = 0.2;
/// How far ahead strikes are planned: about the time to get there, seconds.
const LEAD: f64 = 0.9;
/// A puck that is this far from where it was expected asks for a new plan, metres.
const MISPLACED: f64 = 0.03;
/// Contact normals that are tried per control step.
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
    /// Stops a puck that rolls where it should not.
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

    /// True while a strike must not be interrupted.
    pub fn committed(&self) -> bool {
        matches!(self.phase, Phase::Run { .. } | Phase::Retreat { .. })
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
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

    fn search(&mut self, scene: &Scene<'_>, next: usize, mut best: Option<Strike>) -> Order {
        let puck = &scene.puck;
        let moving = puck.vel.norm() > CALM_PUCK || scene.puck_speed_deviation.norm() > 0.05;
        if moving || prepared(puck) {
            self.phase = Phase::Search {
                next: 0,
                best: None,
            };
            if moving
                && slide_out(scene.field, *puck) < SPOILT
                && let Some(order) = self.absorb.decide(scene)
            {
                return order;
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

    fn approach(&mut self, scene: &Scene<'_>, strike: Strike, planned: Vec2) -> Order {
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
        let way = around(scene, start, field.contact() + 0.012);
        let distance = (scene.mallet.pos - start).norm();
        if way == start && distance < 0.004 && scene.mallet.vel.norm() < 0.05 {
            let time = 2.0 * (contact - start).norm() / strike.velocity.norm();
            self.phase = Phase::Run {
                strike,
                contact: scene.time + time.max(2.0 * scene.dt),
            };
        }
        // Fast at a distance, with care beside the puck.
        Order::stop(
            scene,
            way,
            if distance > 0.15 {
                Pace::QUICK
            } else {
                Pace::CALM
            },
        )
    }

    fn run(&mut self, scene: &Scene<'_>, strike: Strike, contact: f64) -> Order {
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
            return Order::new(
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
        Order::new(
            Target {
                pos,
                vel: strike.velocity,
                time: left,
            },
            Posture::Free,
        )
    }
}

/// Out of the puck's way: towards the other side of the middle, in front of the goal.
fn retreat(scene: &Scene<'_>) -> Order {
    let y = if scene.puck.pos.y > 0.0 { -0.12 } else { 0.12 };
    let pos = Vec2::new(-0.8, y);
    Order::stop(
        scene,
        around(scene, pos, scene.field.contact() + 0.03),
        Pace::QUICK,
    )
}
