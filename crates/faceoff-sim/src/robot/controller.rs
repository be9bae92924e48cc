//! The 1 kHz torque controller with its safety limiter (MODEL, "Controller").

use super::{plant::Plant, trajectory::Setpoint};
use crate::model::{JOINTS, LINKS, SUBSTEP_S};

/// How fast the limiter lets a joint approach its stop, 1/s (ref).
const LIMITER_GAIN: f64 = 20.0;

/// Weight of the newest joint velocity in the low-pass filter, and of the older ones (ref).
const FILTER_NEW: f64 = 0.274;
const FILTER_OLD: f64 = 0.726;

/// Keeps commands within position and velocity limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Limiter {
    /// The previously commanded position, rad.
    commanded: [f64; JOINTS],
}

/// A setpoint within the limits: position, rad, and velocity, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedSetpoint {
    position: [f64; JOINTS],
    velocity: [f64; JOINTS],
}

impl Limiter {
    /// Starts at the joints' initial position.
    pub fn new(q: [f64; JOINTS]) -> Self {
        Self { commanded: q }
    }

    /// Limits the desired motion of one substep.
    #[inline(always)]
    pub fn limit(&mut self, desired: &Setpoint) -> LimitedSetpoint {
        let mut command = LimitedSetpoint {
            position: [0.0; JOINTS],
            velocity: [0.0; JOINTS],
        };
        for i in 0..JOINTS {
            let (q_max, v_max) = (LINKS[i].range_rad, LINKS[i].velocity_limit_rad_s);
            let p = self.commanded[i];
            let slowest = clamp(-LIMITER_GAIN * (p + q_max), -v_max, v_max);
            let fastest = clamp(-LIMITER_GAIN * (p - q_max), -v_max, v_max);
            command.velocity[i] = clamp(or(desired.velocity[i], 0.0), slowest, fastest);
            command.position[i] = clamp(
                or(desired.position[i], p),
                p + SUBSTEP_S * slowest,
                p + SUBSTEP_S * fastest,
            );
        }
        self.commanded = command.position;
        command
    }
}

/// Torques of the driven joints, N m: feedback on position and filtered velocity plus the
/// feed-forward of the nominal model, within the drives' limits.
#[inline(always)]
pub fn torque(
    plant: &Plant,
    command: &LimitedSetpoint,
    q: &[f64],
    dq_filtered: &[f64; JOINTS],
    feed_forward: &[f64; JOINTS],
) -> [f64; JOINTS] {
    std::array::from_fn(|i| {
        let feedback = plant.kp[i] * (command.position[i] - q[i])
            + plant.kd[i] * (command.velocity[i] - dq_filtered[i]);
        let limit = LINKS[i].torque_limit_n_m;
        clamp(or(feedback + feed_forward[i], 0.0), -limit, limit)
    })
}

/// One step of the joint velocity filter.
#[inline(always)]
pub fn filter_velocity(dq_filtered: &mut [f64; JOINTS], dq: &[f64]) {
    for i in 0..JOINTS {
        dq_filtered[i] = FILTER_NEW * dq[i] + FILTER_OLD * dq_filtered[i];
    }
}

/// A desired value that is not a number is none: the joint stays, or is left alone.
#[inline(always)]
fn or(x: f64, otherwise: f64) -> f64 {
    if x.is_nan() { otherwise } else { x }
}

/// `f64::clamp` without its panic; the bounds are in order by construction.
#[inline(always)]
fn clamp(x: f64, low: f64, high: f64) -> f64 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}
