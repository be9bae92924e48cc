//! Simulates strikes at a puck near the rim with the puck model, and gives each a value from 0, a failure, to 1, a *prepared* puck: one
//! that rests in an area from which it can be shot, or crosses the table's long axis slowly enough.

use crate::contact::{SUBSTEP, substep};
use crate::field::{Field, Vec2};
use crate::puck::{DRAG, Puck, Rim};

/// Largest |y| at which a puck counts as prepared, with a margin, metres.
const SAFE_Y: f64 = 0.365;
/// Range of x in which a puck counts as prepared, with a margin, metres.
const SAFE_X: (f64, f64) = (-0.78, -0.22);
/// A puck at a smaller |y| has crossed the long axis, which ends the episode, metres.
const LONG_AXIS_Y: f64 = 0.01;
/// Longest sliding of the puck on one segment, seconds: it has nearly stopped then.
const HORIZON: f64 = 8.0;
/// Deceleration of the mallet after a strike, m/s².
pub const BRAKE: f64 = 7.0;
/// Number of directions of the contact normal that are compared.
pub const NORMALS: usize = 60;
/// Mallet speeds to compare, m/s.
const SPEEDS: [f64; 7] = [0.12, 0.2, 0.3, 0.42, 0.55, 0.7, 0.9];
/// Angles between contact normal and mallet motion to compare, radians.
const SLANTS: [f64; 3] = [0.0, -0.5, 0.5];

/// A strike: contact normal (mallet to puck), mallet velocity, and expected value.
#[derive(Debug, Clone, Copy)]
pub struct Strike {
    pub normal: Vec2,
    pub velocity: Vec2,
    pub value: f64,
}

/// Displacement from the start of the run-up to the contact.
pub fn run_up(velocity: &Vec2) -> Vec2 {
    let time = (0.16 + 0.15 * velocity.norm()).min(0.3);
    0.5 * time * velocity
}

/// Whether the puck will come to rest in the prepared area.
pub fn is_prepared(puck: &Puck) -> bool {
    let rest = puck.pos + puck.vel / DRAG;
    rest.y.abs() < SAFE_Y && rest.x > SAFE_X.0 && rest.x < SAFE_X.1 && puck.vel.x < 0.05
}

fn rotate(vector: Vec2, angle: f64) -> Vec2 {
    let (sin, cos) = angle.sin_cos();
    Vec2::new(
        cos * vector.x - sin * vector.y,
        sin * vector.x + cos * vector.y,
    )
}

/// Evaluates the strikes of the contact normal `index` (below [`NORMALS`]), and stores a better one in `best`.
pub fn try_normal(field: &Field, puck: &Puck, index: usize, best: &mut Option<Strike>) {
    let normal = rotate(
        Vec2::x(),
        std::f64::consts::TAU * index as f64 / NORMALS as f64,
    );
    let contact = puck.pos - field.contact_distance() * normal;
    if (contact - field.clamp_mallet(contact)).norm() > 1e-9 {
        return;
    }
    for slant in SLANTS {
        for speed in SPEEDS {
            let velocity = speed * rotate(normal, slant);
            let start = contact - run_up(&velocity);
            let end = contact + 0.5 * speed / BRAKE * velocity;
            let shortened = (start - field.clamp_mallet(start)).norm();
            if shortened > 0.5 * run_up(&velocity).norm()
                || (end - field.clamp_mallet(end)).norm() > 0.01
            {
                continue;
            }
            let required_value = best.map_or(0.05, |best| best.value + 1e-9);
            if let Some(value) = strike_value(field, puck, normal, velocity, required_value) {
                *best = Some(Strike {
                    normal,
                    velocity,
                    value,
                });
            }
        }
    }
}

/// Mean value of a strike over variations of uncertain parameters (contact normal, speed), if it
/// reaches `required_value`. Gentler strikes have a small advantage.
fn strike_value(
    field: &Field,
    puck: &Puck,
    normal: Vec2,
    velocity: Vec2,
    required_value: f64,
) -> Option<f64> {
    /// Turn of the contact normal, radians, and factor of the speed.
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
        sum += strike_outcome(field, *puck, rotate(normal, *turn), *factor * velocity);
        // The mean if all further variations had the value 1.
        let possible = (sum + count - 1.0 - k as f64) / count - cost;
        if possible < required_value {
            return None;
        }
    }
    Some(sum / count - cost)
}

/// Value of a strike's result: 1 for a prepared puck, less for an easier next strike, 0 for a failure.
fn strike_outcome(field: &Field, mut puck: Puck, normal: Vec2, velocity: Vec2) -> f64 {
    let speed = velocity.norm();
    let direction = velocity / speed;
    // Contact, braking and a short rest of the mallet, in substeps, until puck and mallet are apart.
    let mut mallet = puck.pos - (field.contact_distance() + 1e-4) * normal;
    let mut mallet_speed = speed;
    let mut time = 0.0;
    while time < 0.45 {
        substep(&mut puck, field, mallet, mallet_speed * direction);
        mallet += SUBSTEP * mallet_speed * direction;
        time += SUBSTEP;
        // The reference brakes in the control step after the planned contact.
        if time > 0.01 {
            mallet_speed = (mallet_speed - BRAKE * SUBSTEP).max(0.0);
        }
        if let Some(end) = end_value(&puck) {
            return end;
        }
        let gap = (puck.pos - mallet).norm() - field.contact_distance();
        let is_separating = (puck.vel - mallet_speed * direction).dot(&(puck.pos - mallet)) > 0.0;
        if gap > 0.03
            && is_separating
            && (mallet_speed == 0.0 || gap > 0.1)
            && puck.next_rim(field).is_none_or(|(t, _)| t > 0.02)
        {
            break;
        }
    }
    slide_value(field, puck)
}

/// Value of the episode's end, if the puck has reached it.
fn end_value(puck: &Puck) -> Option<f64> {
    if puck.pos.x > -0.01 {
        return Some(0.0);
    }
    (puck.pos.y.abs() < LONG_AXIS_Y).then(|| crossing_value(puck.pos.x, puck.vel.x))
}

/// Value of crossing the long axis at `x`, metres, with the speed `vx`, m/s: less near the limits of a success.
fn crossing_value(x: f64, vx: f64) -> f64 {
    let x_margin = ((x - SAFE_X.0).min(SAFE_X.1 - x) / 0.06).clamp(0.0, 1.0);
    let slowness = ((0.09 - vx) / 0.06).clamp(0.0, 1.0);
    x_margin * slowness
}

/// Value of the position where the puck comes to rest or crosses the long axis without another contact.
pub fn slide_value(field: &Field, mut puck: Puck) -> f64 {
    for _ in 0..8 {
        let (span, rim) = puck.next_rim(field).map_or((HORIZON, None), |(time, rim)| {
            (time.min(HORIZON), Some(rim))
        });
        let end = puck.pos + puck.vel * ((1.0 - (-DRAG * span).exp()) / DRAG);
        if end.y * puck.pos.y < 0.0 || end.y.abs() < LONG_AXIS_Y {
            // The puck crosses the long axis on this segment.
            let path_share =
                (puck.pos.y.abs() - LONG_AXIS_Y) / (puck.pos.y - end.y).abs().max(1e-9);
            let x = puck.pos.x + path_share * (end.x - puck.pos.x);
            let vx = puck.vel.x - DRAG * (x - puck.pos.x);
            return crossing_value(x, vx);
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
    let pos = puck.pos;
    if pos.x > SAFE_X.0 && pos.x < SAFE_X.1 && pos.y.abs() < SAFE_Y {
        // Crossing the long axis at once is a little better than resting.
        return 0.97;
    }
    // Not prepared, but the next strike may be easier.
    let off_rim = ((field.puck_y_max() - pos.y.abs()) / 0.12).clamp(0.0, 1.0);
    let off_end = ((pos.x + field.puck_x_max()) / 0.2).clamp(0.0, 1.0);
    if pos.x < -0.2 {
        0.3 + 0.4 * off_rim * off_end
    } else {
        0.0
    }
}
