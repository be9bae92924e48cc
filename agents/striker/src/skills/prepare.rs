//! Herding a puck from the rim to where it can be shot.
//!
//! The mallet cannot get between puck and rim, so the puck must come off the rim by a bounce. Many
//! strikes are tried against the puck model, the promising ones again with variations of what is
//! uncertain, and the one that most often ends in the goal area is carried out. The search is spread
//! over control steps to keep each of them short.

use super::absorb::Absorb;
use super::{Order, Scene, around};
use crate::arm::Posture;
use crate::contact::{SUBSTEP, substep};
use crate::field::{Field, Vec2};
use crate::motion::{Pace, Target};
use crate::puck::{DRAG, Puck, Rim};

/// Half width of the strip in which a puck counts as prepared, with a margin.
const SAFE_Y: f64 = 0.365;
/// The area along x, with a margin.
const SAFE_X: (f64, f64) = (-0.78, -0.22);
/// Line at which the episode ends.
const CENTRE_Y: f64 = 0.01;
/// Puck speed below which a strike may be planned, m/s.
const CALM_PUCK: f64 = 0.1;
/// A rolling puck whose prospects are worse than this is stopped.
const SPOILT: f64 = 0.2;
/// How far ahead strikes are planned: about the time to get there, seconds.
const LEAD: f64 = 0.9;
/// A puck that is this far from where it was expected asks for a new plan, metres.
const MISPLACED: f64 = 0.03;
/// Deceleration of the mallet after a strike, m/s².
const BRAKE: f64 = 7.0;
/// Directions of the contact normal that are tried.
const NORMALS: usize = 60;
/// Mallet speeds that are tried, m/s.
const SPEEDS: [f64; 7] = [0.12, 0.2, 0.3, 0.42, 0.55, 0.7, 0.9];
/// Angles between contact normal and mallet motion that are tried, radians.
const SLANTS: [f64; 3] = [0.0, -0.5, 0.5];
/// Contact normals that are tried per control step.
const PER_STEP: usize = 5;

/// A strike: contact normal (mallet to puck), mallet velocity, and what it promises.
#[derive(Debug, Clone, Copy)]
struct Strike {
    normal: Vec2,
    velocity: Vec2,
    value: f64,
}

#[derive(Debug, Clone, Copy)]
enum Phase {
    Search { next: usize, best: Option<Strike> },
    Approach { strike: Strike, puck: Vec2 },
    Run { strike: Strike, contact: f64 },
    Retreat { until: f64 },
}

/// The skill's memory.
#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
    /// Stops a puck that rolls where it should not.
    absorb: Absorb,
}

impl Prepare {
    /// Nothing planned yet.
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
            if moving && slide_out(scene.field, *puck) < SPOILT {
                if let Some(order) = self.absorb.decide(scene) {
                    return order;
                }
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
            Some(strike) if next + PER_STEP >= NORMALS => Phase::Approach { strike, puck: expected.pos },
            None if next + PER_STEP >= NORMALS => Phase::Search { next: 0, best: None },
            _ => Phase::Search { next: next + PER_STEP, best },
        };
        retreat(scene)
    }

    fn approach(&mut self, scene: &Scene<'_>, strike: Strike, planned: Vec2) -> Order {
        let field = scene.field;
        let mut expected = scene.puck;
        expected.advance(field, 0.5 * LEAD);
        if scene.puck.vel.norm() > 1.5 * CALM_PUCK || (expected.pos - planned).norm() > MISPLACED {
            self.phase = Phase::Search { next: 0, best: None };
            return retreat(scene);
        }
        let mut there = scene.puck;
        there.advance(field, run_up(&strike.velocity).norm() * 2.0 / strike.velocity.norm());
        let contact = there.pos - field.contact() * strike.normal;
        let start = field.clamp_mallet(contact - run_up(&strike.velocity));
        let way = around(scene, start, field.contact() + 0.012);
        let distance = (scene.mallet.pos - start).norm();
        if way == start && distance < 0.004 && scene.mallet.vel.norm() < 0.05 {
            let time = 2.0 * (contact - start).norm() / strike.velocity.norm();
            self.phase = Phase::Run { strike, contact: scene.time + time.max(2.0 * scene.dt) };
        }
        // Fast at a distance, with care beside the puck.
        Order::stop(scene, way, if distance > 0.15 { Pace::QUICK } else { Pace::CALM })
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

/// From the start of the run-up to the contact.
fn run_up(velocity: &Vec2) -> Vec2 {
    let time = (0.16 + 0.15 * velocity.norm()).min(0.3);
    0.5 * time * velocity
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

/// Will it do as it is?
fn prepared(puck: &Puck) -> bool {
    let rest = puck.pos + puck.vel / DRAG;
    rest.y.abs() < SAFE_Y && rest.x > SAFE_X.0 && rest.x < SAFE_X.1 && puck.vel.x < 0.05
}

fn turned(v: Vec2, angle: f64) -> Vec2 {
    let (sin, cos) = angle.sin_cos();
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// Tries the strikes of one contact normal.
fn try_normal(field: &Field, puck: &Puck, index: usize, best: &mut Option<Strike>) {
    let normal = turned(
        Vec2::x(),
        std::f64::consts::TAU * index as f64 / NORMALS as f64,
    );
    let contact = puck.pos - field.contact() * normal;
    if (contact - field.clamp_mallet(contact)).norm() > 1e-9 {
        return;
    }
    for slant in SLANTS {
        for speed in SPEEDS {
            let velocity = speed * turned(normal, slant);
            let start = contact - run_up(&velocity);
            let end = contact + 0.5 * speed / BRAKE * velocity;
            let shortened = (start - field.clamp_mallet(start)).norm();
            if shortened > 0.5 * run_up(&velocity).norm()
                || (end - field.clamp_mallet(end)).norm() > 0.01
            {
                continue;
            }
            let least = best.map_or(0.05, |b| b.value + 1e-9);
            if let Some(value) = value(field, puck, normal, velocity, least) {
                *best = Some(Strike {
                    normal,
                    velocity,
                    value,
                });
            }
        }
    }
}

/// Mean worth of a strike over variations of what is uncertain (contact normal, speed), if it exceeds
/// `least`. Gentler strikes are preferred a little.
fn value(field: &Field, puck: &Puck, normal: Vec2, velocity: Vec2, least: f64) -> Option<f64> {
    const VARIATIONS: [(f64, f64); 7] = [
        (0.0, 1.0),
        (0.05, 1.0),
        (-0.05, 1.0),
        (0.0, 0.92),
        (0.0, 1.08),
        (0.1, 1.04),
        (-0.1, 0.96),
    ];
    let count = VARIATIONS.len() as f64;
    let cost = 0.03 * velocity.norm();
    let mut sum = 0.0;
    for (k, (turn, factor)) in VARIATIONS.iter().enumerate() {
        sum += outcome(field, *puck, turned(normal, *turn), *factor * velocity);
        let possible = (sum + count - 1.0 - k as f64) / count - cost;
        if possible < least {
            return None;
        }
    }
    Some(sum / count - cost)
}

/// How a strike ends: 1 prepared, less if nearer to it than before, 0 spoilt.
fn outcome(field: &Field, mut puck: Puck, normal: Vec2, velocity: Vec2) -> f64 {
    let speed = velocity.norm();
    let direction = velocity / speed;
    // Contact, braking and a moment's rest of the mallet, at the scale of the contact.
    let mut mallet = puck.pos - (field.contact() + 1e-4) * normal;
    let mut v = speed;
    let mut time = 0.0;
    while time < 0.45 {
        substep(&mut puck, field, mallet, v * direction);
        mallet += SUBSTEP * v * direction;
        time += SUBSTEP;
        // The reference brakes after the planned contact, which takes a control step to notice.
        if time > 0.01 {
            v = (v - BRAKE * SUBSTEP).max(0.0);
        }
        if let Some(end) = ended(&puck) {
            return end;
        }
        let gap = (puck.pos - mallet).norm() - field.contact();
        let opening = (puck.vel - v * direction).dot(&(puck.pos - mallet)) > 0.0;
        if gap > 0.03
            && opening
            && (v == 0.0 || gap > 0.1)
            && puck.next_rim(field).is_none_or(|(t, _)| t > 0.02)
        {
            break;
        }
    }
    slide_out(field, puck)
}

/// The task's end, if the puck is there.
fn ended(puck: &Puck) -> Option<f64> {
    if puck.pos.x > -0.01 {
        return Some(0.0);
    }
    (puck.pos.y.abs() < CENTRE_Y).then(|| crossing(puck.pos.x, puck.vel.x))
}

/// Worth of crossing the middle at `x` with `vx`: less near the borders of what is asked for.
fn crossing(x: f64, vx: f64) -> f64 {
    let along = ((x - SAFE_X.0).min(SAFE_X.1 - x) / 0.06).clamp(0.0, 1.0);
    let slow = ((0.09 - vx) / 0.06).clamp(0.0, 1.0);
    along * slow
}

/// Where the puck comes to rest or crosses the middle, the mallet out of its way.
fn slide_out(field: &Field, mut puck: Puck) -> f64 {
    for _ in 0..8 {
        let (span, rim) = puck
            .next_rim(field)
            .map_or((8.0, None), |(t, r)| (t.min(8.0), Some(r)));
        let end = puck.pos + puck.vel * ((1.0 - (-DRAG * span).exp()) / DRAG);
        if end.y * puck.pos.y < 0.0 || end.y.abs() < CENTRE_Y {
            // Somewhere on this segment it crosses the middle.
            let share = (puck.pos.y.abs() - CENTRE_Y) / (puck.pos.y - end.y).abs().max(1e-9);
            let x = puck.pos.x + share * (end.x - puck.pos.x);
            let vx = puck.vel.x - DRAG * (x - puck.pos.x);
            return crossing(x, vx);
        }
        if end.x > -0.01 {
            return 0.0;
        }
        match rim {
            Some(Rim::Goal) => return 0.0,
            Some(rim) => {
                puck.advance(field, 0.9999 * span);
                puck.bounce(rim);
            }
            None => {
                puck.pos = end;
                break;
            }
        }
    }
    let p = puck.pos;
    if p.x > SAFE_X.0 && p.x < SAFE_X.1 && p.y.abs() < SAFE_Y {
        return 0.97;
    }
    // Not yet, but is the next strike easier?
    let off_rim = ((field.puck_y() - p.y.abs()) / 0.12).clamp(0.0, 1.0);
    let off_end = ((p.x + field.puck_x()) / 0.2).clamp(0.0, 1.0);
    if p.x < -0.2 {
        0.3 + 0.4 * off_rim * off_end
    } else {
        0.0
    }
}
