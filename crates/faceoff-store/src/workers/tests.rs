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
    let at = |s: i64| start + SignedDuration::from_secs(s);
    workers.record_poll("a", info(4), None, at(0));
    workers.record_poll("b", info(2), Some("it is another program"), at(0));
    assert_eq!(workers.available_slots(at(29)), 4);
    assert_eq!(workers.available_slots(at(30)), 0, "it has timed out");
    let job = Uuid::from_u128(1);
    let hit = SlotReport {
        description: Some("hit"),
        problem: None,
    };
    let stuck = SlotReport {
        description: None,
        problem: Some("the disk is full"),
    };
    workers.record_job("a", "slot-0", job, hit, at(40));
    workers.record_job("a", "slot-0", job, stuck, at(50));
    let all = workers.all();
    assert_eq!(all.len(), 2);
    assert_eq!((all[0].first_seen_at, all[0].last_seen_at), (at(0), at(50)));
    let busy = &all[0].busy_slots["slot-0"];
    assert_eq!(
        (busy.description.as_deref(), busy.since),
        (Some("hit"), at(40))
    );
    assert_eq!(busy.problem.as_deref(), Some("the disk is full"));
    workers.record_job("a", "slot-0", job, SlotReport::default(), at(50));
    assert_eq!(workers.all()[0].busy_slots["slot-0"].problem, None);
    // A worker that started before this process counts with its busy slots.
    workers.record_job("earlier", "slot-3", Uuid::from_u128(2), hit, at(50));
    assert_eq!(workers.available_slots(at(50)), 5);
    workers.end_job(Uuid::from_u128(2));
    workers.end_job(job);
    assert!(workers.all()[0].busy_slots.is_empty());
    // A day later the worker is forgotten.
    workers.record_poll("c", info(1), None, at(50) + FORGET_AFTER);
    assert_eq!(workers.all().len(), 1);

    workers.set_problem("give out work", Some("NATS is away"));
    assert_eq!(workers.problems().len(), 1);
    workers.set_problem("give out work", None);
    assert!(workers.problems().is_empty());
}

#[test]
fn backoff_doubles_with_failures_and_ends_with_success() {
    let workers = Workers::default();
    let start: Timestamp = "2026-03-01T10:00:00Z".parse().expect("an instant");
    let at = |s: i64| start + SignedDuration::from_secs(s);
    let failed = |job, s| workers.record_failure("a", Uuid::from_u128(job), at(s));
    assert_eq!(failed(1, 0), None);
    assert_eq!(failed(1, 0), None);
    assert_eq!(
        failed(1, 0),
        None,
        "a job that fails repeatedly counts once"
    );
    assert_eq!(failed(2, 0), None);
    assert_eq!(workers.backoff_reason("a", at(0)), None);
    assert_eq!(failed(3, 0), Some((3, at(60))));
    let reason = workers.backoff_reason("a", at(59)).expect("it backs off");
    assert!(reason.contains("its last 3 jobs"), "{reason}");
    assert_eq!(
        workers.backoff_reason("a", at(60)),
        None,
        "it may try again"
    );
    assert_eq!(failed(4, 60), Some((4, at(180))));
    for job in 5..25 {
        failed(job, 180);
    }
    assert_eq!(failed(25, 180), Some((25, at(180 + 3600))));
    assert_eq!(workers.backoff_reason("b", at(180)), None);
    workers.record_success("a");
    assert_eq!(workers.backoff_reason("a", at(180)), None);
    assert_eq!(failed(26, 180), None);
}

#[test]
fn files_are_closed_once_no_upload_runs() {
    let (workers, nonce) = (Workers::default(), Uuid::from_u128(1));
    let first = workers.begin_upload(nonce).expect("open");
    assert!(!workers.close_files(nonce), "an upload is running");
    assert!(
        workers.begin_upload(nonce).is_none(),
        "no other upload begins"
    );
    drop(first);
    assert!(workers.close_files(nonce));
    assert!(workers.begin_upload(nonce).is_none());
    workers.forget_files(nonce);
    drop(workers.begin_upload(nonce).expect("a new lease"));
    assert!(workers.lock().files.is_empty(), "the entry is removed");
}
