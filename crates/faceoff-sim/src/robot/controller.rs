//! The 1 kHz torque controller with its safety limiter (MODEL, "Controller").

use super::{plant::PlantLanes, trajectory::Setpoint};
use crate::{
    dynamics::lanes::{Lanes, gather, row},
    model::{JOINTS, LINKS, SUBSTEP_S},
};

/// Largest approach velocity of a joint per distance to its stop, 1/s (ref).
pub(crate) const LIMITER_GAIN: f64 = 20.0;

/// Weights of the new and of the previous value in the low-pass filter of the joint velocity (ref).
pub(crate) const FILTER_NEW: f64 = 0.274;
const FILTER_OLD: f64 = 0.726;

/// Limits commands to the position and velocity limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Limiter<T = f64> {
    /// The previously commanded position, rad.
    commanded: [T; JOINTS],
}

/// A setpoint within the limits: position, rad, and velocity, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedSetpoint<T> {
    position: [T; JOINTS],
    velocity: [T; JOINTS],
}

impl<T: Lanes> Limiter<T> {
    /// Starts at the joints' initial position.
    pub fn new(q: [T; JOINTS]) -> Self {
        Self { commanded: q }
    }

    /// Collects the limiters of several arms.
    #[inline(always)]
    pub fn gather<'a>(limiter: impl Fn(usize) -> &'a Limiter) -> Self {
        Self {
            commanded: gather(|lane| &limiter(lane).commanded),
        }
    }

    /// The limiter of one arm.
    pub fn lane(&self, lane: usize) -> Limiter {
        Limiter {
            commanded: row(&self.commanded, lane),
        }
    }

    /// Limits the desired motion of one substep.
    #[inline(always)]
    pub fn limit(&mut self, desired: &Setpoint<T>) -> LimitedSetpoint<T> {
        let zero = T::splat(0.0);
        let mut command = LimitedSetpoint {
            position: [zero; JOINTS],
            velocity: [zero; JOINTS],
        };
        let (gain, step) = (T::splat(-LIMITER_GAIN), T::splat(SUBSTEP_S));
        for i in 0..JOINTS {
            let q_max = T::splat(LINKS[i].range_rad);
            let v_max = LINKS[i].velocity_limit_rad_s;
            let p = self.commanded[i];
            let within = |v: T| clamp(v, T::splat(-v_max), T::splat(v_max));
            let slowest = within(gain * (p + q_max));
            let fastest = within(gain * (p - q_max));
            command.velocity[i] = clamp(or_else(desired.velocity[i], zero), slowest, fastest);
            command.position[i] = clamp(
                or_else(desired.position[i], p),
                p + step * slowest,
                p + step * fastest,
            );
        }
        self.commanded = command.position;
        command
    }
}

/// Torques of the driven joints, N m: feedback on position and filtered velocity plus the
/// feed-forward of the nominal model, within the drives' limits.
#[inline(always)]
pub fn torque<T: Lanes>(
    plant: &PlantLanes<T>,
    command: &LimitedSetpoint<T>,
    q: &[T],
    dq_filtered: &[T; JOINTS],
    feed_forward: &[T; JOINTS],
) -> [T; JOINTS] {
    std::array::from_fn(|i| {
        let feedback = plant.kp[i] * (command.position[i] - q[i])
            + plant.kd[i] * (command.velocity[i] - dq_filtered[i]);
        let limit = LINKS[i].torque_limit_n_m;
        clamp(
            or_else(feedback + feed_forward[i], T::splat(0.0)),
            T::splat(-limit),
            T::splat(limit),
        )
    })
}

/// One step of the joint velocity filter.
#[inline(always)]
pub fn filter_velocity<T: Lanes>(dq_filtered: &mut [T; JOINTS], dq: &[T]) {
    for i in 0..JOINTS {
        dq_filtered[i] = T::splat(FILTER_NEW) * dq[i] + T::splat(FILTER_OLD) * dq_filtered[i];
    }
}

/// `otherwise` if a desired value is NaN: the joint then stays where it is.
#[inline(always)]
fn or_else<T: Lanes>(x: T, otherwise: T) -> T {
    T::select(x.less_or_equal(x), x, otherwise)
}

/// `f64::clamp` without its panic: the bounds are ordered by construction.
#[inline(always)]
fn clamp<T: Lanes>(x: T, low: T, high: T) -> T {
    x.at_least(low).at_most(high)
}
