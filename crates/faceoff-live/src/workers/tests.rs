//! Tests of the state of remote workers: available slots, back-offs after failures, and uploads of files.

use super::*;

#[test]
fn available_slots_count_online_accepted_workers() {
    let workers = Workers::default();
    let info = |slots| WorkerInfo {
        version: "1.0".to_owned(),
        slots,
        labels: Vec::new(),
    };
    let start: Timestamp = "2026-03-01T10:00:00Z".parse().expect("an instant");
    let time = |s: i64| start + SignedDuration::from_secs(s);
    workers.record_poll("a", info(4), None, time(0));
    workers.record_poll(
        "b",
        info(2),
        Some("its program is another version"),
        time(0),
    );
    assert_eq!(workers.available_slots(time(29)), 4);
    assert_eq!(
        workers.available_slots(time(30)),
        0,
        "the worker has timed out"
    );
    let (job, other_job) = (Uuid::from_u128(1), Uuid::from_u128(2));
    let running_report = SlotReport {
        description: Some("hit"),
        problem: None,
    };
    let stuck_report = SlotReport {
        description: None,
        problem: Some("the disk is full"),
    };
    workers.record_job("a", "slot-0", job, running_report, time(40));
    workers.record_job("a", "slot-0", job, stuck_report, time(50));
    let all = workers.all();
    assert_eq!(all.len(), 2);
    assert_eq!(
        (all[0].first_seen_at, all[0].last_seen_at),
        (time(0), time(50))
    );
    let busy = &all[0].busy_slots["slot-0"];
    assert_eq!(
        (busy.description.as_deref(), busy.since),
        (Some("hit"), time(40))
    );
    assert_eq!(busy.problem.as_deref(), Some("the disk is full"));
    workers.record_job("a", "slot-0", job, SlotReport::default(), time(50));
    assert_eq!(workers.all()[0].busy_slots["slot-0"].problem, None);
    // A worker that started before this process counts with its busy slots.
    workers.record_job("earlier", "slot-3", other_job, running_report, time(50));
    assert_eq!(workers.available_slots(time(50)), 5);
    workers.end_job(other_job);
    workers.end_job(job);
    assert!(workers.all()[0].busy_slots.is_empty());
    // A day later these workers are forgotten.
    workers.record_poll("c", info(1), None, time(50) + FORGET_AFTER);
    assert_eq!(workers.all().len(), 1);

    workers.set_problem("publish jobs", Some("NATS is not reachable"));
    assert_eq!(workers.problems().len(), 1);
    workers.set_problem("publish jobs", None);
    assert!(workers.problems().is_empty());
}

#[test]
fn backoff_doubles_with_failures_and_ends_with_success() {
    let workers = Workers::default();
    let start: Timestamp = "2026-03-01T10:00:00Z".parse().expect("an instant");
    let time = |s: i64| start + SignedDuration::from_secs(s);
    let record_failure = |job, s| workers.record_failure("a", Uuid::from_u128(job), time(s));
    assert_eq!(record_failure(1, 0), None);
    assert_eq!(record_failure(1, 0), None);
    assert_eq!(
        record_failure(1, 0),
        None,
        "a job that fails repeatedly counts once"
    );
    assert_eq!(record_failure(2, 0), None);
    assert_eq!(workers.backoff_reason("a", time(0)), None);
    assert_eq!(record_failure(3, 0), Some((3, time(60))));
    let reason = workers
        .backoff_reason("a", time(59))
        .expect("the worker backs off");
    assert!(reason.contains("its last 3 jobs"), "{reason}");
    assert_eq!(
        workers.backoff_reason("a", time(60)),
        None,
        "the back-off has ended"
    );
    assert_eq!(record_failure(4, 60), Some((4, time(180))));
    for job in 5..25 {
        record_failure(job, 180);
    }
    assert_eq!(record_failure(25, 180), Some((25, time(180) + MAX_BACKOFF)));
    assert_eq!(workers.backoff_reason("b", time(180)), None);
    workers.record_success("a");
    assert_eq!(workers.backoff_reason("a", time(180)), None);
    assert_eq!(record_failure(26, 180), None);
}

#[test]
fn files_are_closed_once_no_upload_runs() {
    let (workers, nonce) = (Workers::default(), Uuid::from_u128(1));
    let upload = workers.begin_upload(nonce).expect("open");
    assert!(!workers.close_files(nonce), "an upload is running");
    assert!(
        workers.begin_upload(nonce).is_none(),
        "no other upload begins"
    );
    drop(upload);
    assert!(workers.close_files(nonce));
    assert!(workers.begin_upload(nonce).is_none());
    workers.forget_files(nonce);
    drop(workers.begin_upload(nonce).expect("a new lease"));
    assert!(workers.lock().files.is_empty(), "the entry is removed");
}
