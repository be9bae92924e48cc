//! Claims, leases, commits and our own faults.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{SeedLabel, Task};
use std::collections::HashSet;

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn many_claimers_never_share_a_unit() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let plan = RunPlan {
        episodes_per_task: 20,
        episodes_per_shard: 1,
        ..plan()
    };
    f.evaluate(submission.id, &plan).await;
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
                    units.push(work.claim.unit);
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
    f.evaluate(submission.id, &plan()).await;
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
async fn what_is_played_can_be_left_to_others() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let team = f.team("Beta").await;
    f.upload(&team).await;
    let claim = async |lot| f.store.claim_of(lot, "slot", LEASE_S, f.now).await.unwrap();
    let rest = claim(Lot::Rest).await.unwrap();
    assert!(matches!(rest.work, Work::Smoke { .. }), "{rest:?}");
    assert!(claim(Lot::Rest).await.is_none(), "shards wait, for others");
    while let Some(Claimed { claim, work }) = claim(Lot::Plays).await {
        let Work::Shard { shard, .. } = work else {
            panic!("expected a shard");
        };
        f.play(&claim, &shard, 0).await;
    }
    let scoring = claim(Lot::Rest).await.unwrap();
    assert!(
        matches!(scoring.work, Work::Finalise { evaluation: of, .. } if of == evaluation.id),
        "{scoring:?}"
    );
}

#[tokio::test]
async fn of_those_who_are_given_the_same_order_one_begins() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await;
    let given = f.store.claim("given out", LEASE_S, f.now).await;
    let Claimed { claim, .. } = given.unwrap().unwrap();
    f.later(i64::from(LEASE_S) - 1);
    let hand_over = async |to: &str| f.store.hand_over(&claim, to, LEASE_S, f.now).await.unwrap();
    assert!(hand_over("one").await);
    assert!(!hand_over("another").await);
    assert!(
        hand_over("one").await,
        "the same one may ask again: it may not have heard the answer"
    );
    let store = f.store.clone();
    let is_held = async || store.is_held(claim.unit, claim.nonce).await.unwrap();
    assert!(is_held().await);
    assert_eq!(
        f.store.end_leases_of("given out", f.now).await.unwrap(),
        0,
        "it is another's now"
    );
    assert_eq!(
        f.store.give_back_all_of("given out", f.now).await.unwrap(),
        0,
        "it is another's now"
    );
    // Whoever gave it out is too late to take it back; what nobody has begun goes to the next.
    let take_back = async |claim: &Claim| f.store.take_back(claim, f.now).await.unwrap();
    assert!(!take_back(&claim).await);
    assert!(is_held().await);
    let given = f.store.claim("given out", LEASE_S, f.now).await;
    let unbegun = given.unwrap().unwrap().claim;
    assert!(take_back(&unbegun).await);
    assert!(!take_back(&unbegun).await, "once");
    let next = f.claim().await.unwrap().claim;
    assert_eq!(next.unit, unbegun.unit);
    f.store.release(&next, f.now).await.unwrap();
    // With the lease's time anew.
    f.later(i64::from(LEASE_S) - 1);
    let mut others = Vec::new();
    while let Some(other) = f.claim().await {
        others.push(other.claim.unit);
    }
    assert!(!others.contains(&claim.unit));
    f.store.release(&claim, f.now).await.unwrap();
    assert!(!is_held().await);
    assert!(
        !f.store
            .hand_over(&claim, "late", LEASE_S, f.now)
            .await
            .unwrap()
    );
}

#[tokio::test]
async fn a_dead_workers_units_are_free_at_once_and_only_those() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await;
    let mut claims = Vec::new();
    for worker in ["dead/slot-0", "dead/slot-1", "deadly/slot-0", "dead"] {
        let work = f
            .store
            .claim(worker, LEASE_S, f.now)
            .await
            .unwrap()
            .unwrap();
        claims.push(work.claim.clone());
    }
    assert_eq!(f.store.end_leases_of("dead", f.now).await.unwrap(), 3);
    assert_eq!(f.store.end_leases_of("dead", f.now).await.unwrap(), 0);
    let mut again = Vec::new();
    while let Some(work) = f.claim().await {
        again.push(work.claim.unit);
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
    f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.later(3600);
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::Now);
}

#[tokio::test]
async fn committing_twice_changes_nothing() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::Now);
    let mut other = commit(&shard, 2);
    other.recording = Some("recordings/other".into());
    let again = f.store.commit_shard(&claim, other, f.now).await.unwrap();
    assert_eq!(again, Committed::Before);
    let stored = f.store.outcomes(evaluation.run).await.unwrap();
    assert_eq!(stored, commit(&shard, 0).outcomes);
    let shards = f.store.shards(evaluation.run).await.unwrap();
    assert_eq!(shards[0].recording, commit(&shard, 0).recording);
    assert!(!f.store.heartbeat(&claim, 2, LEASE_S, f.now).await.unwrap());
}

#[tokio::test]
async fn outcomes_that_do_not_cover_the_shard_are_refused() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
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
    assert!(f.store.outcomes(evaluation.run).await.unwrap().is_empty());
    assert_eq!(
        f.store.commit_shard(&claim, good, f.now).await.unwrap(),
        Committed::Now
    );
}

#[tokio::test]
async fn finalisations_and_then_smoke_runs_come_before_shards_if_all_were_served_alike() {
    let f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let beta = f.ready_team("Beta").await;
    let small = RunPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    let first = f.evaluate(alpha.id, &small).await;
    f.evaluate(beta.id, &small).await;
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(run.id, first.run, "evaluations in order");
    f.play(&claim, &shard, 0).await;
    let team = f.team("Gamma").await;
    f.upload(&team).await;
    f.claim_scoring().await;
    f.claim_smoke().await;
    f.claim_shard().await;
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn a_unit_given_back_at_a_shutdown_is_free_at_once_and_has_lost_nothing() {
    let f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    for _ in 0..2 * MAX_LEASES {
        let (claim, _) = f.claim_smoke().await;
        f.store.release(&claim, f.now).await.unwrap();
    }
    let state = f.store.submission(submission.id).await.unwrap().state;
    assert_eq!(state, SubmissionState::Validating);
}

#[tokio::test]
async fn our_faults_cost_a_pause_and_after_some_the_evaluation_is_played_again() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
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
    assert!(f.claim().await.is_none(), "what we broke rests");
    f.later(i64::from(RERUN_PAUSES_S[0]));
    let (_, run, first) = f.claim_shard().await;
    assert_ne!(run.id, evaluation.run);
    assert_eq!(
        (run.plan, run.seed),
        (plan(), SeedLabel::StageDay(evaluation.of))
    );
    assert_eq!((first.task, first.first_episode), (Task::Hit, 0));
}

#[tokio::test]
async fn what_we_cannot_score_is_played_again() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let small = RunPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    let evaluation = f.evaluate(submission.id, &small).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    for _ in 0..MAX_ATTEMPTS {
        let (claim, _) = f.claim_scoring().await;
        f.store
            .release_failed(&claim, "no space left", f.now)
            .await
            .unwrap();
        assert_eq!(f.finish(&claim, 1.0, "d").await, Committed::LeaseLost);
        f.later(60);
    }
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed { .. }
    ));
    let (_, run, _) = f.claim_shard().await;
    assert_ne!(run.id, evaluation.run);
}

#[tokio::test]
async fn a_smoke_run_that_we_cannot_do_ends_with_our_excuse() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    for _ in 0..MAX_ATTEMPTS {
        let (claim, submission) = f.claim_smoke().await;
        assert_eq!(submission.state, SubmissionState::Validating);
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
    let small = RunPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    let evaluation = f.evaluate(submission.id, &small).await;
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
