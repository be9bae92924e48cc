//! Claims, leases, commits and our own faults.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::Task;
use std::collections::HashSet;

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn many_claimers_never_share_a_unit() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let plan = EvaluationPlan {
        episodes_per_task: 20,
        episodes_per_shard: 1,
        ..plan()
    };
    f.store
        .create_evaluation(submission.id, &plan, f.now)
        .await
        .unwrap();
    let other = f.reopen().await;
    let claimers: Vec<_> = (0..12)
        .map(|index| {
            let store = if index % 2 == 0 {
                f.store.clone()
            } else {
                other.clone()
            };
            let now = f.now;
            tokio::spawn(async move {
                let mut units = Vec::new();
                let worker = format!("slot {index}");
                while let Some(work) = store.claim(&worker, LEASE_S, now).await.unwrap() {
                    units.push(work.claim().unit);
                }
                units
            })
        })
        .collect();
    let mut units = Vec::new();
    for claimer in claimers {
        units.extend(claimer.await.unwrap());
    }
    assert_eq!(units.len(), 60);
    assert_eq!(units.into_iter().collect::<HashSet<_>>().len(), 60);
}

#[tokio::test]
async fn an_expired_lease_is_leased_again_and_its_holder_told() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let (first, _, shard) = f.claim_shard().await;
    f.later(i64::from(LEASE_S) - 1);
    assert!(f.store.heartbeat(&first, 0, LEASE_S, f.now).await.unwrap());
    f.later(i64::from(LEASE_S) - 1);
    let (other, _, second_shard) = f.claim_shard().await;
    assert_ne!(shard.id, second_shard.id, "a renewed lease holds");
    assert_ne!(first.unit, other.unit);
    f.later(1);
    let (heir, _, inherited) = f.claim_shard().await;
    assert_eq!(
        (heir.unit, &inherited),
        (first.unit, &shard),
        "at its end it does not"
    );
    assert!(!f.store.heartbeat(&first, 1, LEASE_S, f.now).await.unwrap());
    assert_eq!(f.play(&first, &shard, 0).await, Committed::LeaseLost);
    f.store.release(&first, f.now).await.unwrap();
    f.store
        .release_failed(&first, "too late", f.now)
        .await
        .unwrap();
    assert!(
        f.store.heartbeat(&heir, 1, LEASE_S, f.now).await.unwrap(),
        "the heir is untouched"
    );
    assert_eq!(f.play(&heir, &shard, 0).await, Committed::Now);
    assert_eq!(f.play(&first, &shard, 0).await, Committed::LeaseLost);
}

#[tokio::test]
async fn a_dead_workers_units_are_free_at_once_and_only_those() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let mut claims = Vec::new();
    for worker in ["dead/slot-0", "dead/slot-1", "deadly/slot-0", "dead"] {
        let work = f
            .store
            .claim(worker, LEASE_S, f.now)
            .await
            .unwrap()
            .unwrap();
        claims.push(work.claim().clone());
    }
    assert_eq!(f.store.end_leases_of("dead", f.now).await.unwrap(), 3);
    assert_eq!(f.store.end_leases_of("dead", f.now).await.unwrap(), 0);
    let mut again = Vec::new();
    while let Some(work) = f.claim().await {
        again.push(work.claim().unit);
    }
    assert_eq!(again.len(), 5, "three of the dead and two that nobody had");
    assert!(!again.contains(&claims[2].unit));
    assert!(
        f.store
            .heartbeat(&claims[2], 0, LEASE_S, f.now)
            .await
            .unwrap()
    );
}

#[tokio::test]
async fn work_finished_after_the_lease_counts_if_nobody_took_the_unit() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let (claim, _, shard) = f.claim_shard().await;
    f.later(3600);
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::Now);
}

#[tokio::test]
async fn committing_twice_changes_nothing() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let (claim, _, shard) = f.claim_shard().await;
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::Now);
    let mut other = commit(&shard, 2);
    other.recording = "recordings/other".into();
    let again = f.store.commit_shard(&claim, other, f.now).await.unwrap();
    assert_eq!(again, Committed::Before);
    let stored = f.store.outcomes(evaluation.id).await.unwrap();
    assert_eq!(stored, commit(&shard, 0).outcomes);
    let shards = f.store.shards(evaluation.id).await.unwrap();
    assert_eq!(shards[0].recording, Some(commit(&shard, 0).recording));
    assert!(!f.store.heartbeat(&claim, 2, LEASE_S, f.now).await.unwrap());
}

#[tokio::test]
async fn outcomes_that_do_not_cover_the_shard_are_refused() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let (claim, _, shard) = f.claim_shard().await;
    let good = commit(&shard, 0);
    let mut short = good.clone();
    short.outcomes.pop();
    let mut swapped = good.clone();
    swapped.outcomes.swap(0, 1);
    let mut foreign = good.clone();
    foreign.outcomes[0].task = Task::Prepare;
    for bad in [short, swapped, foreign] {
        let error = f.store.commit_shard(&claim, bad, f.now).await.unwrap_err();
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    }
    assert!(f.store.outcomes(evaluation.id).await.unwrap().is_empty());
    assert_eq!(
        f.store.commit_shard(&claim, good, f.now).await.unwrap(),
        Committed::Now
    );
}

#[tokio::test]
async fn smoke_runs_and_finalisations_come_before_shards() {
    let f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let beta = f.ready_team("Beta").await;
    let small = EvaluationPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    f.store
        .create_evaluation(alpha.id, &small, f.now)
        .await
        .unwrap();
    f.store
        .create_evaluation(beta.id, &small, f.now)
        .await
        .unwrap();
    let (claim, evaluation, shard) = f.claim_shard().await;
    assert_eq!(evaluation.submission, alpha.id, "evaluations in order");
    f.play(&claim, &shard, 0).await;
    let team = f.team("Gamma").await;
    f.upload(&team).await;
    assert!(matches!(f.claim().await, Some(Work::Smoke { .. })));
    assert!(matches!(f.claim().await, Some(Work::Finalise { .. })));
    assert!(matches!(f.claim().await, Some(Work::Shard { .. })));
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn a_unit_given_back_at_a_shutdown_is_free_at_once_and_has_lost_nothing() {
    let f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    for _ in 0..2 * MAX_LEASES {
        let Some(Work::Smoke { claim, .. }) = f.claim().await else {
            panic!("still queued")
        };
        f.store.release(&claim, f.now).await.unwrap();
    }
    let state = f.store.submission(submission.id).await.unwrap().state;
    assert_eq!(state, SubmissionState::Validating { attempts: 0 });
}

#[tokio::test]
async fn our_faults_cost_a_pause_and_after_some_the_turn_is_given_back() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let (victim, _, shard) = f.claim_shard().await;
    f.store
        .release_failed(&victim, "disk full", f.now)
        .await
        .unwrap();
    let mut open = Vec::new();
    for _ in 1..6 {
        let (claim, _, other) = f.claim_shard().await;
        assert_ne!(other.id, shard.id, "the failed shard rests");
        open.push(claim);
    }
    assert!(f.claim().await.is_none());
    for failure in 2..=MAX_ATTEMPTS {
        f.later(60);
        for claim in &open {
            assert!(f.store.heartbeat(claim, 0, 1000, f.now).await.unwrap());
        }
        let (claim, _, again) = f.claim_shard().await;
        assert_eq!(again.id, shard.id);
        assert!(
            !f.state(evaluation.id).await.is_over(),
            "before failure {failure}"
        );
        f.store
            .release_failed(&claim, "disk full", f.now)
            .await
            .unwrap();
    }
    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed {
            finished_at: f.now,
            reason: "disk full".into()
        }
    );
    for claim in &open {
        assert!(!f.store.heartbeat(claim, 0, LEASE_S, f.now).await.unwrap());
    }
    f.later(60);
    assert!(f.claim().await.is_none());
    f.store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn a_finalisation_that_we_cannot_do_gives_the_turn_back() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let small = EvaluationPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    let evaluation = f
        .store
        .create_evaluation(submission.id, &small, f.now)
        .await
        .unwrap();
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    for _ in 0..MAX_ATTEMPTS {
        let Some(Work::Finalise { claim, .. }) = f.claim().await else {
            panic!()
        };
        f.store
            .release_failed(&claim, "no space left", f.now)
            .await
            .unwrap();
        let late = f
            .store
            .finish_evaluation(&claim, &result(1.0), "d", f.now)
            .await;
        assert!(matches!(late, Err(StoreError::Conflict(_))));
        f.later(60);
    }
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed { .. }
    ));
    f.store
        .create_evaluation(submission.id, &small, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn a_smoke_run_that_we_cannot_do_ends_with_our_excuse() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    for attempt in 1..=MAX_ATTEMPTS {
        let Some(Work::Smoke { claim, submission }) = f.claim().await else {
            panic!()
        };
        assert_eq!(
            submission.state,
            SubmissionState::Validating { attempts: attempt }
        );
        f.store
            .release_failed(&claim, "no cgroup", f.now)
            .await
            .unwrap();
        f.later(60);
    }
    let state = f.store.submission(submission.id).await.unwrap().state;
    assert_eq!(
        state,
        SubmissionState::ValidationError {
            reason: "no cgroup".into()
        }
    );
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn a_unit_that_kills_its_workers_is_given_up() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let small = EvaluationPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    let evaluation = f
        .store
        .create_evaluation(submission.id, &small, f.now)
        .await
        .unwrap();
    for _ in 0..MAX_LEASES {
        f.claim_shard().await;
        f.later(i64::from(LEASE_S));
    }
    assert!(f.claim().await.is_none());
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed { .. }
    ));
}

#[tokio::test]
async fn waiting_workers_hear_of_new_work_and_pages_of_changes() {
    let f = Fixture::new().await;
    let mut signal = f.store.work_signal();
    let mut events = f.store.events();
    let team = f.team("Alpha").await;
    assert!(!signal.has_changed().unwrap());
    let submission = f.upload(&team).await;
    assert!(signal.has_changed().unwrap());
    assert_eq!(events.try_recv().unwrap(), Event::Submission(submission.id));
    signal.mark_unchanged();
    f.validate().await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    assert!(signal.has_changed().unwrap());
    let seen: Vec<_> = std::iter::from_fn(|| events.try_recv().ok()).collect();
    assert_eq!(seen.last(), Some(&Event::Evaluation(evaluation.id)));
}
