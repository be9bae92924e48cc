//! The torque controller of the arm, at 1 kHz: feedback on position and velocity, plus the *feed-forward*, the torques that the nominal
//! model needs for the desired acceleration. Before it, a *limiter* keeps the commands within the limits of position and velocity. It
//! computes several arms at once in SIMD lanes ([`Lanes`]: one number per arm). `q` are joint positions (rad), `dq` velocities (rad/s).
//! Constants marked "reference" are those of the simulator of the 2023 Robot Air Hockey Challenge.

use super::{plant::PlantLanes, trajectory::Setpoint};
use crate::{
    dynamics::lanes::{Lanes, gather, row},
    model::{JOINTS, LINKS, SUBSTEP_S},
};

/// Largest commanded velocity of a joint towards its stop (the end of its range) per distance to the stop, 1/s (reference).
pub(crate) const LIMITER_GAIN: f64 = 20.0;

/// Weights of the new and of the previous value in the low-pass filter of the joint velocity, per substep of 1 ms (reference).
pub(crate) const FILTER_NEW: f64 = 0.274;
const FILTER_OLD: f64 = 0.726;

/// Limits the setpoints (desired positions and velocities) of an arm to its position and velocity limits.
#[derive(Debug, Clone, PartialEq)]
pub struct SetpointLimiter<T = f64> {
    /// The previously commanded position, rad.
    commanded: [T; JOINTS],
}

/// A setpoint within the limits: position, rad, and velocity, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedSetpoint<T> {
    position: [T; JOINTS],
    velocity: [T; JOINTS],
}

impl<T: Lanes> SetpointLimiter<T> {
    /// Starts at the joints' initial position.
    pub fn new(q: [T; JOINTS]) -> Self {
        Self { commanded: q }
    }

    /// Collects the limiters of several arms.
    #[inline(always)]
    pub fn gather<'a>(limiter: impl Fn(usize) -> &'a SetpointLimiter) -> Self {
        Self {
            commanded: gather(|lane| &limiter(lane).commanded),
        }
    }

    /// The limiter of one arm.
    pub fn lane(&self, lane: usize) -> SetpointLimiter {
        SetpointLimiter {
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
            let q_max = T::splat(LINKS[i].range_rad); // rad
            let v_max = LINKS[i].velocity_limit_rad_s; // rad/s
            let previous = self.commanded[i];
            let clamp_velocity = |v: T| clamp(v, T::splat(-v_max), T::splat(v_max));
            let lowest_velocity = clamp_velocity(gain * (previous + q_max));
            let highest_velocity = clamp_velocity(gain * (previous - q_max));
            command.velocity[i] = clamp(
                replace_nan(desired.velocity[i], zero),
                lowest_velocity,
                highest_velocity,
            );
            command.position[i] = clamp(
                replace_nan(desired.position[i], previous),
                previous + step * lowest_velocity,
                previous + step * highest_velocity,
            );
        }
        self.commanded = command.position;
        command
    }
}

/// Torques of the driven joints, N m: feedback on position and filtered velocity plus the
/// `feed_forward` (N m), within the drives' limits.
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
            replace_nan(feedback + feed_forward[i], T::splat(0.0)),
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

/// `x`, or `replacement` if `x` is NaN. A joint with a NaN command then stays where it is.
#[inline(always)]
fn replace_nan<T: Lanes>(x: T, replacement: T) -> T {
    T::select(x.less_or_equal(x), x, replacement)
}

/// `f64::clamp` without its panic: the bounds are ordered by construction.
#[inline(always)]
fn clamp<T: Lanes>(x: T, low: T, high: T) -> T {
    x.at_least(low).at_most(high)
}
