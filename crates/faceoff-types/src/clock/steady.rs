//! A clock that follows the system clock only as far as a monotonic clock explains its time.

use super::{
    start::ClockStart,
    step::{ClockStep, StepCause},
};
use jiff::{SignedDuration, Timestamp};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How far the system clock may deviate and is followed nevertheless. It covers leap seconds and the corrections of a
/// synchronised clock, and is less than what is left of the shortest lease (5 s) when it is renewed after a third.
const TOLERANCE: SignedDuration = SignedDuration::from_secs(3);

/// Many small steps are followed if they are not faster than the speed by which Linux lets time synchronisation correct a
/// clock: 500 parts per million, or 43 s per day.
const MAX_CORRECTION: f64 = 500e-6;

/// How often the expected time is corrected.
const CORRECTION_INTERVAL: SignedDuration = SignedDuration::from_secs(1);

/// In this file a `SignedDuration` is a time since 1970, a reading of the monotonic clock (time since its zero), or a difference.
pub(super) struct SteadyClock {
    system: Box<dyn Fn() -> Timestamp + Send + Sync>,
    monotonic: Box<dyn Fn() -> SignedDuration + Send + Sync>,
    state: Mutex<State>,
}

struct State {
    /// The server's time at the zero of the monotonic clock.
    zero: SignedDuration,
    /// Like `zero`, but it follows small steps only at the speed of [`MAX_CORRECTION`]. Deviations are measured from it, so that
    /// many small steps are noticed like a large one.
    expected_zero: SignedDuration,
    /// The monotonic clock at the last correction.
    corrected_at: SignedDuration,
    /// Set as long as the clock, since the start of the process, has been behind the newest change of the database.
    behind: Option<BehindDatabase>,
}

impl State {
    /// Follows the system clock: `zero` is the time that it now gives to the zero of the monotonic clock, `deviation` its difference
    /// from the expected one, `now` the reading of the monotonic clock.
    fn follow(&mut self, zero: SignedDuration, deviation: SignedDuration, now: SignedDuration) {
        self.zero = zero;
        let elapsed = now.saturating_sub(self.corrected_at);
        if elapsed >= CORRECTION_INTERVAL {
            let max_correction = elapsed.mul_f64(MAX_CORRECTION);
            let correction = deviation.clamp(-max_correction, max_correction);
            self.expected_zero = self.expected_zero.saturating_add(correction);
            self.corrected_at = now;
        }
    }
}

#[derive(Clone, Copy)]
/// The system clock is behind the newest change in the database: it must have been set back while no process ran.
struct BehindDatabase {
    newest_change_at: Timestamp,
    /// How far the clock was behind at the start.
    by: SignedDuration,
}

/// One reading of both clocks.
pub(super) struct Reading {
    pub(super) system_at: Timestamp,
    pub(super) server_at: Timestamp,
    pub(super) step: Option<ClockStep>,
}

impl SteadyClock {
    pub(super) fn new(
        system: Box<dyn Fn() -> Timestamp + Send + Sync>,
        monotonic: Box<dyn Fn() -> SignedDuration + Send + Sync>,
        start: ClockStart,
    ) -> Self {
        let (system_at, corrected_at) = (system(), monotonic());
        // If `zero_at` is known, an earlier process of the same boot has already compared its clock with the database.
        let behind = match (start.zero_at, start.newest_change_at) {
            (None, Some(newest_change_at)) => Some(BehindDatabase {
                newest_change_at,
                by: newest_change_at.duration_since(system_at),
            }),
            _ => None,
        };
        let zero = start.zero_at.map_or_else(
            || system_at.as_duration().saturating_sub(corrected_at),
            Timestamp::as_duration,
        );
        Self {
            system,
            monotonic,
            state: Mutex::new(State {
                zero,
                expected_zero: zero,
                corrected_at,
                behind: behind.filter(|behind| behind.by > TOLERANCE),
            }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn read(&self) -> Reading {
        let mut state = self.lock();
        let before = (self.monotonic)();
        let system_at = (self.system)();
        let after = (self.monotonic)().max(before);
        let system = system_at.as_duration();
        // The thread may have been interrupted between the readings for any time. So the zero is only known to be in a range, and
        // a stored zero within this range is no deviation.
        let (earliest, latest) = (system.saturating_sub(after), system.saturating_sub(before));
        let zero = state.zero.clamp(earliest, latest);
        let deviation = zero.saturating_sub(state.expected_zero);
        let has_step = deviation.abs() > TOLERANCE;
        let server_at = if has_step {
            timestamp(state.zero.saturating_add(after))
        } else {
            state.follow(zero, deviation, after);
            system_at
        };
        if let Some(behind) = state.behind
            && behind.newest_change_at.duration_since(server_at) <= TOLERANCE
        {
            state.behind = None;
        }
        let step = |cause, by| ClockStep {
            cause,
            by,
            system_at,
            server_at,
            zero_at: timestamp(state.zero),
        };
        let step = match (has_step, state.behind) {
            (true, _) => {
                let by = zero.saturating_sub(state.zero);
                Some(step(StepCause::MonotonicClock, by))
            }
            (false, Some(behind)) => Some(step(StepCause::NewestChange, -behind.by)),
            (false, None) => None,
        };
        Reading {
            system_at,
            server_at,
            step,
        }
    }

    pub(super) fn accept(&self, step: &ClockStep) -> bool {
        // The system clock may have been set again since.
        let is_current = self.read().step.is_some_and(|current| {
            current.cause == step.cause
                && (current.by - step.by).abs() <= TOLERANCE
                && current.zero_at.duration_since(step.zero_at).abs() <= TOLERANCE
        });
        if !is_current {
            return false;
        }
        let mut state = self.lock();
        state.zero = state.zero.saturating_add(step.shift());
        state.expected_zero = state.zero;
        state.behind = None;
        true
    }

    pub(super) fn revert(&self, step: &ClockStep) {
        let mut state = self.lock();
        state.zero = state.zero.saturating_sub(step.shift());
        state.expected_zero = state.zero;
    }

    pub(super) fn zero_at(&self) -> Timestamp {
        timestamp(self.lock().zero)
    }
}

/// The instant at this time since 1970.
fn timestamp(since_epoch: SignedDuration) -> Timestamp {
    Timestamp::from_duration(since_epoch).unwrap_or(if since_epoch.is_negative() {
        Timestamp::MIN
    } else {
        Timestamp::MAX
    })
}

#[cfg(test)]
mod tests;
