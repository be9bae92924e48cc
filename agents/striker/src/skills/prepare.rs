//! Herding a puck from the rim to where it can be shot.
//!
//! The mallet cannot get between puck and rim, so the puck must come off the rim by a bounce. Many
//! strikes (direction × speed) are tried against the puck model, each with several versions of what
//! is uncertain, and the one that most often ends in the goal area is carried out.

use super::{Order, Scene, around};
use crate::arm::Posture;
use crate::field::{Field, Vec2};
use crate::motion::{Pace, Target};
use crate::puck::{Puck, Rim};

/// Half width of the strip in which a puck counts as prepared, with a margin.
const SAFE_Y: f64 = 0.36;
/// The area along x, with a margin.
const SAFE_X: (f64, f64) = (-0.77, -0.23);
/// Line at which the episode ends.
const CENTRE_Y: f64 = 0.01;
/// Puck speed below which a new strike may be planned, m/s.
const CALM_PUCK: f64 = 0.06;

/// A strike: from where, along which direction, how fast.
#[derive(Debug, Clone, Copy)]
struct Strike {
    normal: Vec2,
    speed: f64,
    value: f64,
}

#[derive(Debug, Clone, Copy)]
enum Phase {
    Choose,
    Approach { strike: Strike },
    Run { strike: Strike, contact: f64 },
    Retreat { until: f64 },
}

/// The skill's memory.
#[derive(Debug, Clone)]
pub struct Prepare {
    phase: Phase,
}

impl Prepare {
    /// Nothing planned yet.
    pub fn new() -> Self {
        Self {
            phase: Phase::Choose,
        }
    }

    /// True while a strike must not be interrupted.
    pub fn committed(&self) -> bool {
        matches!(self.phase, Phase::Run { .. } | Phase::Retreat { .. })
    }

    /// The order for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> Order {
        match self.phase {
            Phase::Choose => self.choose(scene),
            Phase::Approach { strike } => self.approach(scene, strike),
            Phase::Run { strike, contact } => self.run(scene, strike, contact),
            Phase::Retreat { until } => {
                if scene.time > until {
                    self.phase = Phase::Choose;
                }
                retreat(scene)
            }
        }
    }

    fn choose(&mut self, scene: &Scene<'_>) -> Order {
        let puck = &scene.puck;
        if prepared(puck) || puck.vel.norm() > CALM_PUCK {
            return retreat(scene);
        }
        match best_strike(scene) {
            Some(strike) => {
                self.phase = Phase::Approach { strike };
                self.approach(scene, strike)
            }
            None => retreat(scene),
        }
    }

    fn approach(&mut self, scene: &Scene<'_>, strike: Strike) -> Order {
        let field = scene.field;
        if scene.puck.vel.norm() > 2.0 * CALM_PUCK {
            self.phase = Phase::Choose;
            return retreat(scene);
        }
        let contact = scene.puck.pos - field.contact() * strike.normal;
        let run = run_up(strike.speed);
        let start = field.clamp_mallet(contact - 0.5 * run * strike.speed * strike.normal);
        let way = around(scene, start, field.contact() + 0.012);
        if way == start
            && (scene.mallet.pos - start).norm() < 0.004
            && scene.mallet.vel.norm() < 0.03
        {
            let time = 2.0 * (contact - start).norm() / strike.speed;
            self.phase = Phase::Run {
                strike,
                contact: scene.time + time.max(2.0 * scene.dt),
            };
        }
        Order::stop(scene, way, Pace::CALM)
    }

    fn run(&mut self, scene: &Scene<'_>, strike: Strike, contact: f64) -> Order {
        let left = contact - scene.time;
        let velocity = strike.speed * strike.normal;
        if left <= 0.5 * scene.dt {
            if left < -0.03 {
                self.phase = Phase::Retreat {
                    until: scene.time + 0.4,
                };
                return retreat(scene);
            }
            let target = Target {
                pos: scene.mallet.pos + 0.1 * velocity,
                vel: velocity,
                time: 0.1,
            };
            return Order {
                target,
                posture: Posture::Fast,
            };
        }
        let mallet = scene.puck.pos - scene.field.contact() * strike.normal;
        Order {
            target: Target {
                pos: mallet,
                vel: velocity,
                time: left,
            },
            posture: Posture::Fast,
        }
    }
}

/// Duration of the run-up of a strike, seconds.
fn run_up(speed: f64) -> f64 {
    (0.16 + 0.15 * speed).min(0.3)
}

/// Out of the puck's way: to the far side of the middle, in front of the goal.
fn retreat(scene: &Scene<'_>) -> Order {
    let y = if scene.puck.pos.y > 0.0 { -0.12 } else { 0.12 };
    let pos = Vec2::new(-0.8, y);
    Order::stop(
        scene,
        around(scene, pos, scene.field.contact() + 0.02),
        Pace::QUICK,
    )
}

/// Will it do as it is?
fn prepared(puck: &Puck) -> bool {
    let rest = puck.pos + puck.vel / crate::puck::DRAG;
    rest.y.abs() < SAFE_Y && rest.x > SAFE_X.0 && rest.x < SAFE_X.1 && puck.vel.x < 0.05
}

fn best_strike(scene: &Scene<'_>) -> Option<Strike> {
    let field = scene.field;
    let mut best: Option<Strike> = None;
    for k in 0..48 {
        let angle = std::f64::consts::TAU * f64::from(k) / 48.0;
        let normal = Vec2::new(angle.cos(), angle.sin());
        let contact = scene.puck.pos - field.contact() * normal;
        for speed in [0.15, 0.25, 0.4, 0.6, 0.8, 1.0] {
            let start = contact - 0.5 * run_up(speed) * speed * normal;
            if (contact - field.clamp_mallet(contact)).norm() > 1e-9
                || (start - field.clamp_mallet(start)).norm() > 0.6 * (contact - start).norm()
            {
                continue;
            }
            let value = value(field, &scene.puck, normal, speed);
            if value > 0.05 && best.is_none_or(|b| value > b.value) {
                best = Some(Strike {
                    normal,
                    speed,
                    value,
                });
            }
        }
    }
    best
}

/// Mean worth of a strike over versions of what is uncertain: contact normal, restitution, speed.
fn value(field: &Field, puck: &Puck, normal: Vec2, speed: f64) -> f64 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for turn in [-0.07, 0.0, 0.07] {
        let (sin, cos) = f64::sin_cos(turn);
        let n = Vec2::new(
            cos * normal.x - sin * normal.y,
            sin * normal.x + cos * normal.y,
        );
        for loss in [0.9, 1.0, 1.15] {
            let mut p = *puck;
            let mallet = p.pos - field.contact() * n;
            p.strike(mallet, speed * normal);
            sum += outcome(field, p, loss, mallet, speed * normal);
            count += 1.0;
        }
    }
    sum / count
}

/// How a rolling puck ends: 1 prepared, less if nearer to it than before, 0 spoilt.
fn outcome(field: &Field, mut puck: Puck, loss: f64, mallet: Vec2, follow: Vec2) -> f64 {
    // While the mallet follows through and stops it is still in the way.
    let shadow = mallet + 0.06 * follow;
    let mut elapsed = 0.0;
    for _ in 0..8 {
        let (span, rim) = puck
            .next_rim(field)
            .map_or((8.0, None), |(t, r)| (t.min(8.0), Some(r)));
        // Look along the segment in steps fine enough for the mallet and the end lines.
        let steps = 12;
        let mut there = puck;
        for _ in 0..steps {
            let before = there;
            there.advance(field, 0.999 * span / f64::from(steps));
            elapsed += span / f64::from(steps);
            if elapsed < 0.5 && elapsed > 0.06 && (there.pos - shadow).norm() < field.contact() {
                return 0.0;
            }
            if there.pos.x > 0.0 {
                return 0.0;
            }
            if there.pos.y.abs() < CENTRE_Y || there.pos.y * before.pos.y < 0.0 {
                let inside = there.pos.x > SAFE_X.0 && there.pos.x < SAFE_X.1;
                return if inside && there.vel.x < 0.07 {
                    1.0
                } else {
                    0.0
                };
            }
        }
        puck = there;
        match rim {
            Some(Rim::Goal) => return 0.0,
            Some(rim) => {
                puck.bounce(rim);
                match rim {
                    Rim::Long => puck.vel.y *= loss,
                    _ => puck.vel.x *= loss,
                }
                // Step off the rim so that it is not met again at once.
                puck.pos += 1e-6 * puck.vel.map(f64::signum);
            }
            None => break,
        }
    }
    let p = puck.pos;
    if p.x > SAFE_X.0 && p.x < SAFE_X.1 && p.y.abs() < SAFE_Y {
        return 0.95;
    }
    // Not yet, but is the next strike easier?
    let off_rim = ((field.puck_y() - p.y.abs()) / 0.12).clamp(0.0, 1.0);
    let off_end = ((p.x + field.puck_x()) / 0.2).clamp(0.0, 1.0);
    if p.x < -0.25 {
        0.5 * off_rim * off_end
    } else {
        0.0
    }
}
