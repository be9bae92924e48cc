//! Events: each change of the season is recorded as an event in the same transaction, and then sent to subscribers in this
//! process. The job signal wakes workers when a job can be claimed.

use crate::fixture::*;
use faceoff_store::*;
use std::collections::BTreeSet;

/// All events, the oldest first.
async fn stored_events(f: &TestStore) -> Vec<EventRecord> {
    f.store.events_after(0, 1000).await.unwrap()
}

/// The kinds of events, as they are stored.
fn event_kinds(records: &[EventRecord]) -> Vec<String> {
    records.iter().map(event_kind).collect()
}

#[tokio::test]
async fn events_record_each_step_of_a_submission() {
    let f = TestStore::new().await;
    let one_task = two_shard_plan();
    f.configure_stage(&one_task).await;
    let submission = f.valid_submission_of("Alpha").await;
    let evaluation = f.evaluate(submission.id, &one_task).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    let (claim, ..) = f.claim_shard().await;
    f.store
        .release_after_platform_fault(&claim, "disk full", f.now)
        .await
        .unwrap();
    f.store
        .set_team_token(
            Actor::Operator,
            submission.team,
            [9; 32],
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    let mut records = stored_events(&f).await;
    let first = records.remove(0);
    assert_eq!(first.actor, Actor::Operator);
    assert!(matches!(first.event, Event::StageCreated { .. }));
    assert_eq!(
        event_kinds(&records),
        [
            "team_created",
            "token_created",
            "submission_uploaded",
            "submission_valid",
            "submission_activated",
            "evaluation_queued",
            "day_started",
            "evaluation_begun",
            "shard_committed",
            "unit_given_back",
            "token_created",
            "token_replaced",
        ]
    );
    let team = Subject::Team(submission.team);
    assert_eq!((records[0].subject, records[11].subject), (team, team));
    assert_eq!(records[2].actor, Actor::Team(submission.team));
    assert_eq!(records[2].subject, Subject::Submission(submission.id));
    let slot = Actor::Worker("slot 0".into());
    for record in &records[7..10] {
        assert_eq!(record.actor, slot);
        assert_eq!(record.subject, Subject::Evaluation(evaluation.id));
        assert_eq!(record.at, f.now);
    }
    assert_eq!(
        records[8].event,
        Event::ShardCommitted {
            run: evaluation.run,
            shard: shard.id,
            task: shard.task,
            first_episode: shard.first_episode,
            end_episode: shard.end_episode,
            agent_faults: 0,
        }
    );
    assert_eq!(
        records[9].event,
        Event::JobFailed {
            job: claim.job,
            failures: 1,
            reason: "disk full".into(),
        }
    );
    // Reads at most two events after one that is known.
    let newer = f.store.events_after(records[6].id, 2).await.unwrap();
    assert_eq!(newer, records[7..9]);
}

#[tokio::test]
async fn events_record_each_end_of_an_evaluation() {
    let mut f = TestStore::new().await;
    let alpha = f.valid_submission_of("Alpha").await;
    let one_task = RunPlan {
        max_faults: 0,
        ..one_shard_plan()
    };
    #[derive(Debug)]
    enum End {
        Finished,
        AgentFailed,
        Cancelled,
        PlatformFailed,
    }
    // One day for each end.
    for end in [
        End::Finished,
        End::AgentFailed,
        End::Cancelled,
        End::PlatformFailed,
    ] {
        f.advance_clock_s(86_400);
        let evaluation = f.evaluate(alpha.id, &one_task).await;
        let (claim, _, shard) = f.claim_shard().await;
        match end {
            End::Finished => {
                f.commit_shard(&claim, &shard).await;
                let (claim, _) = f.claim_scoring().await;
                f.finish_scoring(&claim, 7.0, DATASET_KEY).await;
            }
            End::AgentFailed => drop(f.commit_shard_with_faults(&claim, &shard, 1).await),
            End::Cancelled => {
                let cancelled =
                    f.store
                        .cancel_evaluation(Actor::Operator, evaluation.id, "rain", f.now);
                cancelled.await.unwrap();
            }
            End::PlatformFailed => {
                f.store.release(&claim, f.now).await.unwrap();
                for _ in 0..MAX_PLATFORM_FAULTS {
                    let (claim, ..) = f.claim_shard().await;
                    let released = f
                        .store
                        .release_after_platform_fault(&claim, "no disk", f.now);
                    released.await.unwrap();
                    f.advance_clock_s(60);
                }
            }
        }
    }
    let kinds: BTreeSet<_> = event_kinds(&stored_events(&f).await).into_iter().collect();
    for kind in [
        "evaluation_finalising",
        "evaluation_finished",
        "evaluation_agent_failed",
        "evaluation_cancelled",
        "evaluation_platform_failed",
        "day_started",
        "day_released",
    ] {
        assert!(kinds.contains(kind), "{kind} is not in {kinds:?}");
    }
}

#[tokio::test]
async fn failed_operation_changes_nothing_and_sends_no_event() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let cancelled = f
        .store
        .cancel_evaluation(Actor::Operator, evaluation.id, "rain", f.now);
    cancelled.await.unwrap();
    let rerun = || {
        f.store
            .rerun_evaluation(Actor::Operator, evaluation.id, f.now)
    };
    rerun().await.unwrap();
    let events_before = stored_events(&f).await;
    let (mut events, mut signal) = (f.store.events(), f.store.job_signal());
    signal.mark_unchanged();
    // The second rerun is refused after its run was divided into shards and queued.
    assert!(matches!(rerun().await, Err(StoreError::Conflict(_))));
    assert_eq!(stored_events(&f).await, events_before);
    assert!(events.try_recv().is_err());
    assert!(!signal.has_changed().unwrap());
    // The six shards of the first rerun.
    for _ in 0..6 {
        f.claim_shard().await;
    }
    assert!(
        f.claim().await.is_none(),
        "no job of the refused rerun is queued"
    );
}

#[tokio::test]
async fn signals_report_new_jobs_and_changes() {
    let f = TestStore::new().await;
    let mut signal = f.store.job_signal();
    let mut events = f.store.events();
    let team = f.create_team("Alpha").await;
    assert!(!signal.has_changed().unwrap());
    let submission = f.upload(&team).await;
    assert!(signal.has_changed().unwrap());
    signal.mark_unchanged();
    f.validate().await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    assert!(signal.has_changed().unwrap());
    let (claim, _, shard) = f.claim_shard().await;
    f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap();
    signal.mark_unchanged();
    f.store.release(&claim, f.now).await.unwrap();
    assert!(signal.has_changed().unwrap());
    signal.mark_unchanged();
    let (claim, ..) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    assert!(!signal.has_changed().unwrap(), "no new job to claim");

    let sent: Vec<_> = std::iter::from_fn(|| events.try_recv().ok()).collect();
    let stored = stored_events(&f).await;
    let records: Vec<_> = sent
        .iter()
        .filter_map(|change| match change {
            Change::Recorded(record) => Some(EventRecord::clone(record)),
            Change::Progress(_) => None,
        })
        .collect();
    assert_eq!(records, stored, "the stored events are sent");
    let subject = Subject::Evaluation(evaluation.id);
    let progress = sent
        .iter()
        .filter(|change| **change == Change::Progress(subject))
        .count();
    assert_eq!(progress, 4, "two claims, a heartbeat and a release");
    assert_eq!(sent.last().unwrap().subject(), subject);
}
