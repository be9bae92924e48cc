//! From actions at 50 Hz to a trajectory at 1 kHz (MODEL, "Interpolation").

use super::model::{CONTROL_STEP_S as T, JOINTS, SUBSTEP_S, SUBSTEPS};

/// How actions become a trajectory (PROTOCOL). Polynomials start at the end of the previous
/// commanded trajectory, at reset at the initial position with zero velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Order 1: positions, linear.
    Linear,
    /// Order 2: positions, quadratic.
    Quadratic,
    /// Order 3: positions and velocities, cubic.
    Cubic,
    /// Order 4: positions and velocities, quartic.
    Quartic,
    /// Order 5: positions, velocities and accelerations, quintic.
    Quintic,
    /// Order −1: positions and velocities, each linear.
    LinearBoth,
    /// No interpolation: position, velocity and acceleration at every millisecond.
    Trajectory,
}

impl Interpolation {
    /// From the protocol's code: 1, 2, 3, 4, 5, −1 or null.
    #[must_use]
    pub fn from_code(code: Option<i64>) -> Option<Self> {
        Some(match code {
            Some(1) => Self::Linear,
            Some(2) => Self::Quadratic,
            Some(3) => Self::Cubic,
            Some(4) => Self::Quartic,
            Some(5) => Self::Quintic,
            Some(-1) => Self::LinearBoth,
            None => Self::Trajectory,
            Some(_) => return None,
        })
    }

    /// The protocol's code.
    #[must_use]
    pub fn code(self) -> Option<i64> {
        Some(match self {
            Self::Linear => 1,
            Self::Quadratic => 2,
            Self::Cubic => 3,
            Self::Quartic => 4,
            Self::Quintic => 5,
            Self::LinearBoth => -1,
            Self::Trajectory => return None,
        })
    }

    /// Shape of an action, e.g. `[2, 7]`.
    #[must_use]
    pub fn shape(self) -> &'static [usize] {
        match self {
            Self::Linear | Self::Quadratic => &[JOINTS],
            Self::Cubic | Self::Quartic | Self::LinearBoth => &[2, JOINTS],
            Self::Quintic => &[3, JOINTS],
            Self::Trajectory => &[SUBSTEPS, 3, JOINTS],
        }
    }

    /// The action that commands a position, rad, at rest, in the first [`Interpolation::len`] places.
    #[must_use]
    pub fn held(self, position: &[f64; JOINTS]) -> [f64; MAX_ACTION_LEN] {
        let mut action = [0.0; MAX_ACTION_LEN];
        let every = match self {
            Self::Trajectory => 3 * JOINTS,
            _ => MAX_ACTION_LEN,
        };
        for point in action.chunks_mut(every) {
            point[..JOINTS].copy_from_slice(position);
        }
        action
    }

    /// Numbers in an action: the product of its shape.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "an action is never empty")]
    pub fn len(self) -> usize {
        self.shape().iter().product()
    }
}

/// Numbers in the longest action, a whole trajectory.
pub const MAX_ACTION_LEN: usize = SUBSTEPS * 3 * JOINTS;

/// Desired motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// rad.
    pub position: [f64; JOINTS],
    /// rad/s.
    pub velocity: [f64; JOINTS],
    /// rad/s².
    pub acceleration: [f64; JOINTS],
}

impl Setpoint {
    /// At rest.
    #[must_use]
    pub fn at_rest(position: [f64; JOINTS]) -> Self {
        Self {
            position,
            velocity: [0.0; JOINTS],
            acceleration: [0.0; JOINTS],
        }
    }
}

/// The desired motion at t = 1…20 ms of a control step; the last one starts the next step.
pub type Trajectory = [Setpoint; SUBSTEPS];

/// Below this distance, rad, a quadratic starts at rest (ref).
const QUADRATIC_REST_RAD: f64 = 1e-3;

/// Interpolates one action. `action` is row-major, of length [`Interpolation::len`].
pub fn interpolate(interpolation: Interpolation, from: &Setpoint, action: &[f64]) -> Trajectory {
    let row = |r: usize, j: usize| action[r * JOINTS + j];
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
            let dp = row(0, j) - p - v * T - 0.5 * a * T * T;
            let dv = row(1, j) - v - a * T;
            let (c3, c4) = (4.0 * dp - dv * T, dv * T - 3.0 * dp);
            [p, v, 0.5 * a, c3 / (T * T * T), c4 / (T * T * T * T), 0.0]
        }),
        Interpolation::Quintic => polynomial(|j| {
            let (p, v, a) = (from.position[j], from.velocity[j], from.acceleration[j]);
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
        Interpolation::LinearBoth => std::array::from_fn(|k| {
            let s = (k + 1) as f64 / SUBSTEPS as f64;
            let between = |from: f64, to: f64| from + (to - from) * s;
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

/// Evaluates a polynomial per joint, coefficients in rising order.
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
