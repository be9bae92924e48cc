use super::super::{Clock, ClockStart, StepCause};
use jiff::{SignedDuration, Timestamp};
use std::sync::{
    Arc,
    atomic::{AtomicI64, Ordering},
};

const START: &str = "2026-03-01T10:00:00Z";
const DAY_MS: i64 = 86_400_000;

/// A machine whose clocks the test sets.
#[derive(Clone, Default)]
struct Machine {
    monotonic_ms: Arc<AtomicI64>,
    /// By how much the system clock was set since the start.
    set_ms: Arc<AtomicI64>,
    /// For how long each reading of the monotonic clock interrupts the thread.
    interruption_ms: Arc<AtomicI64>,
}

impl Machine {
    fn clock(&self, start: ClockStart) -> Clock {
        let (system, monotonic) = (self.clone(), self.clone());
        Clock::steady(
            move || {
                let ms = system.monotonic_ms.load(Ordering::SeqCst)
                    + system.set_ms.load(Ordering::SeqCst);
                at(ms)
            },
            move || {
                let interruption_ms = monotonic.interruption_ms.load(Ordering::SeqCst);
                let ms = monotonic
                    .monotonic_ms
                    .fetch_add(interruption_ms, Ordering::SeqCst);
                SignedDuration::from_millis(ms)
            },
            start,
        )
    }

    fn pass(&self, ms: i64) {
        self.monotonic_ms.fetch_add(ms, Ordering::SeqCst);
    }

    fn set(&self, by_ms: i64) {
        self.set_ms.fetch_add(by_ms, Ordering::SeqCst);
    }
}

/// The time so many milliseconds after the start, by a clock that is never set.
fn at(ms: i64) -> Timestamp {
    let start: Timestamp = START.parse().unwrap();
    start + SignedDuration::from_millis(ms)
}

#[test]
fn clock_without_steps_is_the_system_clock() {
    let machine = Machine::default();
    let clock = machine.clock(ClockStart::default());
    // 90 days without a reading, as of a suspended machine: its monotonic clock goes on, too.
    for ms in [0, 1, 1000, 90 * DAY_MS] {
        machine.pass(ms);
        let now = at(machine.monotonic_ms.load(Ordering::SeqCst));
        assert_eq!((clock.now(), clock.earliest()), (now, now));
        assert_eq!(clock.step(), None);
    }
}

#[test]
fn step_is_reported_and_not_followed_until_set_back() {
    for by_ms in [5 * DAY_MS, -DAY_MS, 3001, -3001] {
        let machine = Machine::default();
        let clock = machine.clock(ClockStart::default());
        machine.pass(60_000);
        machine.set(by_ms);
        machine.pass(60_000);
        assert_eq!(clock.now(), at(120_000));
        let step = clock.step().unwrap();
        assert_eq!(step.cause, StepCause::MonotonicClock);
        assert_eq!(step.by, SignedDuration::from_millis(by_ms));
        assert_eq!(step.system_at, at(120_000 + by_ms));
        assert_eq!(step.server_at, at(120_000));
        assert_eq!(clock.earliest(), at(120_000 + by_ms.min(0)));
        machine.set(-by_ms);
        assert_eq!((clock.now(), clock.step()), (at(120_000), None));
    }
}

#[test]
fn accepted_step_changes_the_time_once() {
    let machine = Machine::default();
    let clock = machine.clock(ClockStart::default());
    machine.set(-DAY_MS);
    let step = clock.step().unwrap();
    assert_eq!(step.size(), "86400 s behind");
    assert!(clock.accept(&step));
    assert!(!clock.accept(&step), "it is accepted already");
    assert_eq!((clock.now(), clock.step()), (at(-DAY_MS), None));
    machine.set(DAY_MS);
    assert_eq!(clock.step().unwrap().size(), "86400 s ahead");
    assert_eq!(clock.now(), at(-DAY_MS));
}

#[test]
fn small_corrections_are_followed_but_not_their_sum() {
    let machine = Machine::default();
    let clock = machine.clock(ClockStart::default());
    // A leap second, and a clock that is corrected by 20 parts per million once a day.
    machine.set(-1000);
    assert_eq!((clock.now(), clock.step()), (at(-1000), None));
    for _ in 0..90 {
        machine.pass(DAY_MS);
        machine.set(1728);
        assert_eq!(clock.step(), None);
    }
    // 100 steps of 1 s within 100 s move the clock by no more than the tolerated 3 s in all, beside the 100 s that pass.
    let before = clock.now();
    for _ in 0..100 {
        machine.pass(1000);
        machine.set(1000);
        assert!(clock.now() >= before);
    }
    let (gained, step) = (clock.now().duration_since(before), clock.step());
    assert!(gained < SignedDuration::from_secs(105), "{gained:?}");
    assert!(step.is_some());
}

#[test]
fn interrupted_reading_is_no_step() {
    let machine = Machine::default();
    let clock = machine.clock(ClockStart::default());
    machine.interruption_ms.store(60_000, Ordering::SeqCst);
    for _ in 0..10 {
        assert_eq!(clock.step(), None);
    }
    machine.set(DAY_MS);
    assert!(clock.step().is_some());
}

#[test]
fn record_of_the_same_boot_shows_a_step_at_the_start() {
    let machine = Machine::default();
    machine.pass(60_000);
    let zero_at = machine.clock(ClockStart::default()).zero_at();
    assert_eq!(zero_at, Some(at(0)));
    machine.set(5 * DAY_MS);
    machine.pass(60_000);
    let restarted = machine.clock(ClockStart {
        zero_at,
        // It says nothing more than the record.
        newest_change_at: Some(at(DAY_MS)),
    });
    assert_eq!(restarted.now(), at(120_000));
    assert_eq!(restarted.step().unwrap().size(), "432000 s ahead");
    // After the next boot only a clock that was set back can be noticed.
    let booted = machine.clock(ClockStart {
        zero_at: None,
        newest_change_at: Some(at(60_000)),
    });
    assert_eq!(
        (booted.now(), booted.step()),
        (at(120_000 + 5 * DAY_MS), None)
    );
}

#[test]
fn clock_before_the_newest_change_is_reported() {
    let machine = Machine::default();
    let start = ClockStart {
        zero_at: None,
        newest_change_at: Some(at(3_600_000)),
    };
    let clock = machine.clock(start);
    machine.pass(1000);
    let step = clock.step().unwrap();
    assert_eq!(step.cause, StepCause::NewestChange);
    assert_eq!(step.size(), "3600 s behind");
    assert_eq!(clock.now(), at(1000), "there is no better time");
    // It catches up automatically, or is accepted. Either holds, even if the clock is set afterwards.
    let (waiting, accepting) = (clock.clone(), machine.clock(start));
    let step = accepting.step().unwrap();
    assert!(accepting.accept(&step));
    assert!(!accepting.accept(&step), "it is accepted already");
    assert_eq!((accepting.now(), accepting.step()), (at(1000), None));
    machine.pass(3_597_000);
    assert_eq!((waiting.now(), waiting.step()), (at(3_598_000), None));
    machine.set(-3_600_000);
    assert_eq!(
        waiting.step().unwrap().cause,
        StepCause::MonotonicClock,
        "the monotonic clock explains it better"
    );
    // A change that is one second ahead of the clock is within the tolerance.
    let nearly = ClockStart {
        newest_change_at: Some(at(1000)),
        ..start
    };
    assert_eq!(Machine::default().clock(nearly).step(), None);
}

#[test]
fn past_step_is_not_accepted_and_acceptance_can_be_undone() {
    let machine = Machine::default();
    let clock = machine.clock(ClockStart::default());
    machine.set(DAY_MS);
    let step = clock.step().unwrap();
    machine.set(-DAY_MS);
    assert!(!clock.accept(&step), "the clock is right again");
    assert_eq!((clock.now(), clock.step()), (at(0), None));
    machine.set(2 * DAY_MS);
    assert!(!clock.accept(&step), "it is another step");
    let step = clock.step().unwrap();
    assert!(clock.accept(&step));
    assert_eq!(clock.now(), at(2 * DAY_MS));
    clock.revert(&step);
    assert_eq!(clock.now(), at(0));
    assert_eq!(clock.step().unwrap().by, step.by);
}
