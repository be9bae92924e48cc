//! A host's clock that goes back, or jumps ahead: jobs, webhook deliveries and evaluation days. An organiser can *accept* such a step;
//! until then the server does not follow it.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::Schedule;
use jiff::{SignedDuration, civil::date};
use sqlx::Connection as _;

const DAY_S: i64 = 86_400;

/// Moves the clock, as an organiser accepts a step.
async fn accept_clock_step(f: &mut TestStore, by_s: i64) {
    f.advance_clock_s(by_s);
    let by = SignedDuration::from_secs(by_s);
    let accepted = f.store.accept_clock_step(
        Actor::Operator,
        by,
        "a step".into(),
        f.now,
        Box::new(|| true),
    );
    accepted.await.unwrap();
}

#[tokio::test]
async fn accepted_step_ends_no_lease_and_delays_no_job() {
    for by_s in [5 * DAY_S, -DAY_S] {
        let mut f = TestStore::new().await;
        f.start_evaluation(&two_shard_plan()).await;
        let (running, ..) = f.claim_shard().await;
        let (failed, ..) = f.claim_shard().await;
        f.store
            .release_after_platform_fault(&failed, "a fault", f.now)
            .await
            .unwrap();
        accept_clock_step(&mut f, by_s).await;
        f.advance_clock_s(1);
        assert!(f.claim().await.is_none(), "one job runs, the other waits");
        let renewed = f.store.heartbeat(&running, 1, LEASE_S, f.now).await;
        assert!(renewed.unwrap());
        // The first pause after a failure is two seconds.
        f.advance_clock_s(1);
        assert_eq!(f.claim().await.unwrap().claim.job, failed.job);
        // A dead worker's lease expires as usual.
        f.advance_clock_s(i64::from(LEASE_S));
        assert!(f.claim().await.is_some());
        let kinds = f.event_kinds_since(0).await;
        assert!(kinds.iter().any(|kind| kind == "clock_step_accepted"));
    }
}

#[tokio::test]
async fn refused_step_changes_nothing() {
    let f = TestStore::new().await;
    f.start_evaluation(&two_shard_plan()).await;
    let later = f.now + SignedDuration::from_secs(DAY_S);
    let by = SignedDuration::from_secs(DAY_S);
    let refused = f.store.accept_clock_step(
        Actor::Operator,
        by,
        "a step".into(),
        later,
        Box::new(|| false),
    );
    assert_conflict(refused.await, &["set again"]);
    assert!(f.claim().await.is_some());
}

#[tokio::test]
async fn jobs_from_a_future_clock_run_after_a_restart() {
    let mut f = TestStore::new().await;
    f.advance_clock_s(5 * DAY_S);
    f.start_evaluation(&two_shard_plan()).await;
    let (leased, ..) = f.claim_shard().await;
    f.advance_clock_s(-5 * DAY_S);
    assert!(f.claim().await.is_none());
    let shorten = async |f: &TestStore| f.store.shorten_due_times(LEASE_S, f.now).await.unwrap();
    assert_eq!(shorten(&f).await, 2);
    assert_eq!(shorten(&f).await, 0);
    assert_ne!(f.claim().await.unwrap().claim.job, leased.job);
    assert!(f.claim().await.is_none(), "the lease may be renewed");
    f.advance_clock_s(i64::from(LEASE_S));
    assert!(f.claim().await.is_some());
    // Usual delays stay.
    assert_eq!(shorten(&f).await, 0);
}

#[tokio::test]
async fn future_deliveries_are_due_after_a_restart() {
    let mut f = TestStore::new().await;
    let mut connection = f.connection().await;
    sqlx::raw_sql(
        "PRAGMA foreign_keys = OFF;
         INSERT INTO webhook_deliveries (id, webhook_id, kind, body, created_at, attempts, next_at, state)
         VALUES ('d', 'w', 'test', '{}', 0, 1, 4102444800000, 'waiting')",
    )
    .execute(&mut connection)
    .await
    .unwrap();
    f.store.shorten_due_times(LEASE_S, f.now).await.unwrap();
    let mut due = async || -> i64 {
        let due = sqlx::query_scalar("SELECT next_at FROM webhook_deliveries");
        due.fetch_one(&mut connection).await.unwrap()
    };
    assert_eq!(due().await, f.now.as_millisecond());
    accept_clock_step(&mut f, -DAY_S).await;
    assert_eq!(due().await, f.now.as_millisecond());
    connection.close().await.unwrap();
}

#[tokio::test]
async fn voided_future_day_frees_the_schedule() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let schedule = Schedule::daily("06:00".parse().unwrap());
    let plan = two_shard_plan();
    let stage = faceoff_testkit::configure_stage(&f.store, &plan, Some(schedule), f.now).await;
    let start = async |f: &TestStore| {
        let started = f.store.start_scheduled_day(stage, f.now).await.unwrap();
        started.map(|evaluations| evaluations.len())
    };
    let next_date = async |f: &TestStore| {
        let stage = f.store.stage(stage).await.unwrap();
        let next = f.store.next_cutoff(&stage, f.now).await.unwrap();
        next.map(|(date, _)| date)
    };
    // The clock is three days ahead for a minute, and a day starts. It is 1 March, ten o'clock.
    f.advance_clock_s(3 * DAY_S);
    assert_eq!(start(&f).await, Some(1));
    f.advance_clock_s(-3 * DAY_S);
    assert_eq!(next_date(&f).await, Some(date(2026, 3, 5)));
    assert_eq!(start(&f).await, None);
    let first = f.store.stage(stage).await.unwrap();
    let future = f.store.future_day(&first, f.now).await.unwrap().unwrap();
    assert_eq!(future.stage_day.date, date(2026, 3, 4));

    let voided = f
        .store
        .void_day(Actor::Operator, future.stage_day, "clock", f.now);
    assert_eq!(voided.await.unwrap(), 1);
    assert_eq!(f.store.future_day(&first, f.now).await.unwrap(), None);
    assert_eq!(next_date(&f).await, Some(date(2026, 3, 2)));
    assert_eq!(start(&f).await, Some(1));
    assert_eq!(start(&f).await, None, "a day has one cutoff");
    for day in [2, 3] {
        f.advance_clock_s(DAY_S);
        assert_eq!(next_date(&f).await, Some(date(2026, 3, day)));
        assert_eq!(start(&f).await, Some(1));
    }
    // The seed of the voided day is public.
    assert_eq!(next_date(&f).await, Some(date(2026, 3, 5)));
    f.advance_clock_s(DAY_S);
    assert_eq!(start(&f).await, None);
    f.advance_clock_s(DAY_S);
    assert_eq!(start(&f).await, Some(1));
}

#[tokio::test]
async fn empty_future_day_does_not_hold_the_schedule() {
    let mut f = TestStore::new().await;
    let stage = f.configure_stage(&two_shard_plan()).await;
    // While the clock is three days ahead, a day starts without any submission.
    f.advance_clock_s(3 * DAY_S);
    let empty = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(empty, Some(Vec::new()));
    f.advance_clock_s(-3 * DAY_S);
    let today = f.store.start_scheduled_day(stage, f.now).await.unwrap();
    assert_eq!(today, Some(Vec::new()));
}
