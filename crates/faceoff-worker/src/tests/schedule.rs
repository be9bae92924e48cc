use crate::schedule::update_due_days_unless_behind;
use faceoff_testkit::{configure_stage, new_store, one_shard_plan};
use faceoff_types::{Clock, ClockStart, Schedule};
use jiff::{SignedDuration, Timestamp};
use std::sync::{Arc, Mutex};

#[tokio::test]
async fn no_day_starts_while_the_clock_is_behind_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let store = new_store(folder.path()).await;
    let first: Timestamp = "2026-03-01T00:00:00Z".parse().unwrap();
    let schedule = Schedule::daily("06:00".parse().unwrap());
    configure_stage(&store, &one_shard_plan(), Some(schedule), first).await;
    // A machine that was started with a clock that is two hours behind.
    let now = Arc::new(Mutex::new("2026-03-01T06:30:00Z".parse().unwrap()));
    let clock = |start| {
        let (system, monotonic) = (Arc::clone(&now), Arc::clone(&now));
        Clock::steady(
            move || *system.lock().unwrap(),
            move || monotonic.lock().unwrap().as_duration(),
            start,
        )
    };
    let behind = clock(ClockStart {
        zero_at: None,
        newest_change_at: Some("2026-03-01T08:30:00Z".parse().unwrap()),
    });
    let competition = faceoff_airhockey::competition();
    let days = async |clock: &Clock| {
        let started = update_due_days_unless_behind(&store, &competition, clock, clock.now()).await;
        started.unwrap();
        store.days().await.unwrap().len()
    };
    assert_eq!(days(&behind).await, 0);
    let advance_two_hours = |now: &mut Timestamp| *now += SignedDuration::from_hours(2);
    advance_two_hours(&mut now.lock().unwrap());
    assert_eq!(days(&behind).await, 1);
}
