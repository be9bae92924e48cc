//! The clock that is passed in, so that libraries do not read the system's time themselves. A *step* is a change of the system
//! clock that a monotonic clock does not explain: someone, or a time service, has set it. An organiser can accept a step.

mod start;
mod steady;
mod step;

use jiff::{SignedDuration, Timestamp};
pub use start::ClockStart;
use std::{fmt, sync::Arc};
use steady::SteadyClock;
pub use step::{ClockStep, StepCause};

/// Source of the current time for leases and days. Programs pass in one that compares the system clock with a monotonic
/// clock, tests one that they advance themselves.
#[derive(Clone)]
pub struct Clock(Source);

#[derive(Clone)]
enum Source {
    /// Any function that returns the time, such as one of a test.
    Function(Arc<dyn Fn() -> Timestamp + Send + Sync>),
    /// The system clock without its steps.
    Steady(Arc<SteadyClock>),
}

impl Clock {
    /// A clock that calls `now` for each reading.
    pub fn new(now: impl Fn() -> Timestamp + Send + Sync + 'static) -> Self {
        Self(Source::Function(Arc::new(now)))
    }

    /// A clock that follows the system clock as long as the monotonic clock, which also runs while the machine is suspended,
    /// explains its time. After a step of the system clock it continues by the monotonic clock, until the system clock is
    /// set back or the step is [accepted](Self::accept).
    pub fn steady(
        system: impl Fn() -> Timestamp + Send + Sync + 'static,
        monotonic: impl Fn() -> SignedDuration + Send + Sync + 'static,
        start: ClockStart,
    ) -> Self {
        let steady = SteadyClock::new(Box::new(system), Box::new(monotonic), start);
        Self(Source::Steady(Arc::new(steady)))
    }

    #[must_use]
    pub fn now(&self) -> Timestamp {
        match &self.0 {
            Source::Function(now) => now(),
            Source::Steady(steady) => steady.read().server_at,
        }
    }

    /// The earlier one of the current time and of the system clock's time. Times of files are the system clock's, so a file
    /// is surely old only if both clocks say so.
    #[must_use]
    pub fn earliest(&self) -> Timestamp {
        match &self.0 {
            Source::Function(now) => now(),
            Source::Steady(steady) => {
                let reading = steady.read();
                reading.server_at.min(reading.system_at)
            }
        }
    }

    /// The step of the system clock that is not accepted; `None` if there is none.
    #[must_use]
    pub fn step(&self) -> Option<ClockStep> {
        match &self.0 {
            Source::Function(_) => None,
            Source::Steady(steady) => steady.read().step,
        }
    }

    /// Accepts a step: the clock's time changes by it. False, without a change, if the system clock was set again, or a step was
    /// accepted, since.
    #[must_use]
    pub fn accept(&self, step: &ClockStep) -> bool {
        match &self.0 {
            Source::Function(_) => false,
            Source::Steady(steady) => steady.accept(step),
        }
    }

    /// Undoes the acceptance of a step, because it could not be stored.
    pub fn revert(&self, step: &ClockStep) {
        if let Source::Steady(steady) = &self.0 {
            steady.revert(step);
        }
    }

    /// The time at the zero of the monotonic clock, which is the boot of the machine; `None` without a monotonic clock. The next
    /// process of the same boot starts with it ([`ClockStart`]).
    #[must_use]
    pub fn zero_at(&self) -> Option<Timestamp> {
        match &self.0 {
            Source::Function(_) => None,
            Source::Steady(steady) => Some(steady.zero_at()),
        }
    }
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Clock(..)")
    }
}
