//! Events are recorded with the change, and sent to subscribers after it.

use crate::fixture::*;
use faceoff_store::*;
use std::collections::BTreeSet;

async fn recorded(f: &TestStore) -> Vec<EventRecord> {
    f.store.events_after(0, 1000).await.unwrap()
}

/// The variants' names, as they are stored.
fn kinds(records: &[EventRecord]) -> Vec<String> {
    records
        .iter()
        .map(|record| {
            let json = serde_json::to_value(&record.event).unwrap();
            json["kind"].as_str().unwrap().to_owned()
        })
        .collect()
}

#[tokio::test]
async fn events_record_each_step_of_a_submission() {
    let f = TestStore::new().await;
    let small = RunPlan {
        tasks: vec![faceoff_types::Task::Hit],
        ..plan()
    };
    f.stage(&small).await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &small).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 0).await;
    let (claim, ..) = f.claim_shard().await;
    f.store
        .release_failed(&claim, "disk full", f.now)
        .await
        .unwrap();
    f.store
        .set_team_token(Actor::Organiser, submission.team, [9; 32], f.now)
        .await
        .unwrap();
    let mut records = recorded(&f).await;
    let stage = records.remove(0);
    assert_eq!(stage.actor, Actor::Organiser);
    assert!(matches!(stage.event, Event::StageCreated { .. }));
    assert_eq!(
        kinds(&records),
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
            first_episode: 0,
            end_episode: 2,
            agent_faults: 0,
        }
    );
    assert_eq!(
        records[9].event,
        Event::UnitGivenBack {
            unit: claim.job,
            failures: 1,
            reason: "disk full".into(),
        }
    );
    // continue from a known id
    let later = f.store.events_after(records[6].id, 2).await.unwrap();
    assert_eq!(later, records[7..9]);
}

#[tokio::test]
async fn events_record_each_end_of_an_evaluation() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let small = RunPlan {
        tasks: vec![faceoff_types::Task::Hit],
        episodes_per_task: 1,
        max_faults: 0,
        ..plan()
    };
    // one day for each end
    for end in 0..4 {
        f.later(86_400);
        let evaluation = f.evaluate(alpha.id, &small).await;
        let (claim, _, shard) = f.claim_shard().await;
        match end {
            0 => {
                f.commit_shard(&claim, &shard, 0).await;
                let (claim, _) = f.claim_scoring().await;
                f.finish(&claim, 7.0, "d").await;
            }
            1 => drop(f.commit_shard(&claim, &shard, 1).await),
            2 => {
                let stop =
                    f.store
                        .cancel_evaluation(Actor::Organiser, evaluation.id, "rain", f.now);
                stop.await.unwrap();
            }
            _ => {
                f.store.release(&claim, f.now).await.unwrap();
                for _ in 0..MAX_ATTEMPTS {
                    let (claim, ..) = f.claim_shard().await;
                    let fail = f.store.release_failed(&claim, "no disk", f.now);
                    fail.await.unwrap();
                    f.later(60);
                }
            }
        }
    }
    let seen: BTreeSet<_> = kinds(&recorded(&f).await).into_iter().collect();
    for kind in [
        "evaluation_finalising",
        "evaluation_finished",
        "evaluation_agent_failed",
        "evaluation_cancelled",
        "evaluation_platform_failed",
        "day_started",
        "day_released",
    ] {
        assert!(seen.contains(kind), "{kind} is not in {seen:?}");
    }
}

#[tokio::test]
async fn failed_operation_changes_nothing_and_sends_no_event() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let stop = f
        .store
        .cancel_evaluation(Actor::Organiser, evaluation.id, "rain", f.now);
    stop.await.unwrap();
    let rerun = || {
        f.store
            .rerun_evaluation(Actor::Organiser, evaluation.id, f.now)
    };
    rerun().await.unwrap();
    let before = recorded(&f).await;
    let (mut events, mut signal) = (f.store.events(), f.store.job_signal());
    signal.mark_unchanged();
    // it fails after a run was divided into shards and queued
    assert!(matches!(rerun().await, Err(StoreError::Conflict(_))));
    assert_eq!(recorded(&f).await, before);
    assert!(events.try_recv().is_err());
    assert!(!signal.has_changed().unwrap());
    for _ in 0..6 {
        f.claim_shard().await;
    }
    assert!(f.claim().await.is_none(), "no job of it is queued");
}

#[tokio::test]
async fn signals_report_new_jobs_and_changes() {
    let f = TestStore::new().await;
    let mut signal = f.store.job_signal();
    let mut events = f.store.events();
    let team = f.team("Alpha").await;
    assert!(!signal.has_changed().unwrap());
    let submission = f.upload(&team).await;
    assert!(signal.has_changed().unwrap());
    signal.mark_unchanged();
    f.validate().await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    assert!(signal.has_changed().unwrap());
    let (claim, _, shard) = f.claim_shard().await;
    f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap();
    signal.mark_unchanged();
    f.store.release(&claim, f.now).await.unwrap();
    assert!(signal.has_changed().unwrap());
    signal.mark_unchanged();
    let (claim, ..) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 0).await;
    assert!(!signal.has_changed().unwrap(), "no new job to claim");

    let sent: Vec<_> = std::iter::from_fn(|| events.try_recv().ok()).collect();
    let in_table = recorded(&f).await;
    let records: Vec<_> = sent
        .iter()
        .filter_map(|change| match change {
            Change::Recorded(record) => Some(EventRecord::clone(record)),
            Change::Progress(_) => None,
        })
        .collect();
    assert_eq!(records, in_table, "the stored events are sent");
    let subject = Subject::Evaluation(evaluation.id);
    let progress = sent
        .iter()
        .filter(|change| **change == Change::Progress(subject))
        .count();
    assert_eq!(progress, 4, "two claims, a heartbeat and a release");
    assert_eq!(sent.last().unwrap().subject(), subject);
}
