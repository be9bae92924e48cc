//! Interpolation of an agent's action, which comes at 50 Hz, to the desired motion at 1 kHz. `docs/protocol.md` ("Actions") says what the
//! rows of an action are in each interpolation; the polynomials are those of the *reference*, the simulator of the 2023 Robot Air Hockey
//! Challenge.
//!
//! Symbols: `T` is the duration of a control step (s), `j` a joint; p, v and a are the position (rad), velocity (rad/s) and acceleration
//! (rad/s²) at the start of the step, which is the end of the previous trajectory.

use crate::Interpolation;
use crate::{
    dynamics::lanes::{Lanes, gather},
    model::{CONTROL_STEP_S as T, JOINTS, SUBSTEP_S, SUBSTEPS},
};

/// Desired motion of the joints at one instant; `L` is `f64` for one arm, or SIMD lanes for several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint<L = f64> {
    /// rad.
    pub position: [L; JOINTS],
    /// rad/s.
    pub velocity: [L; JOINTS],
    /// rad/s².
    pub acceleration: [L; JOINTS],
}

impl<L: Lanes> Setpoint<L> {
    /// Collects the setpoints of several arms.
    #[inline(always)]
    pub fn gather<'a>(setpoint: impl Fn(usize) -> &'a Setpoint) -> Self {
        Self {
            position: gather(|lane| &setpoint(lane).position),
            velocity: gather(|lane| &setpoint(lane).velocity),
            acceleration: gather(|lane| &setpoint(lane).acceleration),
        }
    }
}

impl Setpoint {
    #[must_use]
    pub fn at_rest(position: [f64; JOINTS]) -> Self {
        Self {
            position,
            velocity: [0.0; JOINTS],
            acceleration: [0.0; JOINTS],
        }
    }
}

/// The desired motion at t = 1…20 ms of a control step; the next step starts from the last setpoint.
pub type Trajectory = [Setpoint; SUBSTEPS];

/// A quadratic starts at rest if all joints together are closer than this to the action, rad (reference).
const QUADRATIC_REST_RAD: f64 = 1e-3;

/// Interpolates one action, starting at `from`. `action` is row-major, of length [`Interpolation::len`].
pub fn interpolate(interpolation: Interpolation, from: &Setpoint, action: &[f64]) -> Trajectory {
    let row = |row: usize, j: usize| action[row * JOINTS + j];
    match interpolation {
        Interpolation::Linear => polynomial(|j| {
            let p = from.position[j];
            [p, (row(0, j) - p) / T, 0.0, 0.0, 0.0, 0.0]
        }),
        Interpolation::Quadratic => {
            let distance_sq: f64 = (0..JOINTS)
                .map(|j| (row(0, j) - from.position[j]) * (row(0, j) - from.position[j]))
                .sum();
            let at_rest = distance_sq.sqrt() < QUADRATIC_REST_RAD;
            polynomial(|j| {
                let p = from.position[j];
                let v = if at_rest { 0.0 } else { from.velocity[j] };
                [p, v, (row(0, j) - p - v * T) / (T * T), 0.0, 0.0, 0.0]
            })
        }
        Interpolation::Cubic => polynomial(|j| {
            let (p, v) = (from.position[j], from.velocity[j]);
            // Differences at the end of the step between the action and a motion that continues at velocity v.
            let dp = row(0, j) - p - v * T;
            let dv = row(1, j) - v;
            [
                p,
                v,
                (3.0 * dp - dv * T) / (T * T),
                (dv * T - 2.0 * dp) / (T * T * T),
                0.0,
                0.0,
            ]
        }),
        Interpolation::Quartic => polynomial(|j| {
            let (p, v, a) = (from.position[j], from.velocity[j], from.acceleration[j]);
            // Differences at the end of the step between the action and a motion that continues at acceleration a.
            let dp = row(0, j) - p - v * T - 0.5 * a * T * T;
            let dv = row(1, j) - v - a * T;
            let (c3, c4) = (4.0 * dp - dv * T, dv * T - 3.0 * dp);
            [p, v, 0.5 * a, c3 / (T * T * T), c4 / (T * T * T * T), 0.0]
        }),
        Interpolation::Quintic => polynomial(|j| {
            let (p, v, a) = (from.position[j], from.velocity[j], from.acceleration[j]);
            // As in the quartic, in position, velocity · T and acceleration · T².
            let dp = row(0, j) - p - v * T - 0.5 * a * T * T;
            let dv = (row(1, j) - v - a * T) * T;
            let da = (row(2, j) - a) * T * T;
            [
                p,
                v,
                0.5 * a,
                (10.0 * dp - 4.0 * dv + 0.5 * da) / (T * T * T),
                (-15.0 * dp + 7.0 * dv - da) / (T * T * T * T),
                (6.0 * dp - 3.0 * dv + 0.5 * da) / (T * T * T * T * T),
            ]
        }),
        Interpolation::LinearPositionAndVelocity => std::array::from_fn(|k| {
            let share = (k + 1) as f64 / SUBSTEPS as f64;
            let between = |from: f64, to: f64| from + (to - from) * share;
            Setpoint {
                position: std::array::from_fn(|j| between(from.position[j], row(0, j))),
                velocity: std::array::from_fn(|j| between(from.velocity[j], row(1, j))),
                acceleration: std::array::from_fn(|j| (row(1, j) - from.velocity[j]) / T),
            }
        }),
        Interpolation::Trajectory => std::array::from_fn(|k| Setpoint {
            position: std::array::from_fn(|j| row(3 * k, j)),
            velocity: std::array::from_fn(|j| row(3 * k + 1, j)),
            acceleration: std::array::from_fn(|j| row(3 * k + 2, j)),
        }),
    }
}

/// Evaluates one polynomial in time (s) per joint at each millisecond; `coefficients` in rising order.
fn polynomial(coefficients: impl Fn(usize) -> [f64; 6]) -> Trajectory {
    let coefficients: [[f64; 6]; JOINTS] = std::array::from_fn(coefficients);
    std::array::from_fn(|k| {
        let t = (k + 1) as f64 * SUBSTEP_S;
        let mut setpoint = Setpoint::at_rest([0.0; JOINTS]);
        for (j, [c0, c1, c2, c3, c4, c5]) in coefficients.into_iter().enumerate() {
            setpoint.position[j] = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))));
            setpoint.velocity[j] =
                c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)));
            setpoint.acceleration[j] = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5));
        }
        setpoint
    })
}
