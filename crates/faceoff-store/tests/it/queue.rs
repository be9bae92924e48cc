//! The queue of jobs: a worker claims a job under a lease, renews the lease with heartbeats, and commits the result once. After a
//! platform fault, for example a full disk, the job is run again.

use crate::fixture::*;
use faceoff_airhockey::{HIT, PREPARE};
use faceoff_store::*;
use faceoff_types::SeedLabel;
use std::collections::HashSet;

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn concurrent_claims_never_share_a_job() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let plan = RunPlan {
        episodes_per_task: 20,
        episodes_per_shard: 1,
        ..six_shard_plan()
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
                let mut jobs = Vec::new();
                let worker = format!("slot {index}");
                while let Some(claimed) = store.claim(&worker, LEASE_S, now).await.unwrap() {
                    jobs.push(claimed.claim.job);
                }
                jobs
            })
        })
        .collect();
    let mut jobs = Vec::new();
    for claimer in claimers {
        jobs.extend(claimer.await.unwrap());
    }
    // Three tasks of 20 episodes.
    assert_eq!(jobs.len(), 60);
    assert_eq!(jobs.into_iter().collect::<HashSet<_>>().len(), 60);
}

#[tokio::test]
async fn expired_lease_is_reassigned_and_old_holder_refused() {
    let mut f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let (first, _, shard) = f.claim_shard().await;
    f.advance_clock_s(i64::from(LEASE_S) - 1);
    assert!(f.store.heartbeat(&first, 0, LEASE_S, f.now).await.unwrap());
    f.advance_clock_s(i64::from(LEASE_S) - 1);
    let (other, _, second_shard) = f.claim_shard().await;
    assert_ne!(shard.id, second_shard.id, "the renewed lease is valid");
    assert_ne!(first.job, other.job);
    f.advance_clock_s(1);
    let (successor, _, reassigned_shard) = f.claim_shard().await;
    assert_eq!(
        (successor.job, &reassigned_shard),
        (first.job, &shard),
        "an expired lease is reassigned"
    );
    assert!(!f.store.heartbeat(&first, 1, LEASE_S, f.now).await.unwrap());
    assert_eq!(
        f.commit_shard(&first, &shard).await,
        CommitOutcome::LeaseLost
    );
    f.store.release(&first, f.now).await.unwrap();
    f.store
        .release_after_platform_fault(&first, "too late", f.now)
        .await
        .unwrap();
    assert!(
        f.store
            .heartbeat(&successor, 1, LEASE_S, f.now)
            .await
            .unwrap(),
        "the new lease is not affected"
    );
    assert_eq!(
        f.commit_shard(&successor, &shard).await,
        CommitOutcome::Stored
    );
    assert_eq!(
        f.commit_shard(&first, &shard).await,
        CommitOutcome::LeaseLost
    );
}

#[tokio::test]
async fn job_filter_limits_claims() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let team = f.create_team("Beta").await;
    f.upload(&team).await;
    let claim = async |filter| {
        f.store
            .claim_matching(filter, "slot", LEASE_S, f.now)
            .await
            .unwrap()
    };
    let validation = claim(JobFilter::ValidationAndScoring).await.unwrap();
    assert!(
        matches!(validation.job, Job::Validation { .. }),
        "{validation:?}"
    );
    assert!(
        claim(JobFilter::ValidationAndScoring).await.is_none(),
        "shards are not claimed"
    );
    while let Some(ClaimedJob { claim, job }) = claim(JobFilter::ShardsAndGames).await {
        let Job::Shard { shard, .. } = job else {
            panic!("expected a shard");
        };
        f.commit_shard(&claim, &shard).await;
    }
    let scoring = claim(JobFilter::ValidationAndScoring).await.unwrap();
    assert!(
        matches!(scoring.job, Job::Scoring { evaluation: scored, .. } if scored == evaluation.id),
        "{scoring:?}"
    );
}

#[tokio::test]
async fn lease_transfer_succeeds_for_one_worker() {
    let mut f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let claimed = f.store.claim("reserved", LEASE_S, f.now).await;
    let ClaimedJob { claim, .. } = claimed.unwrap().unwrap();
    f.advance_clock_s(i64::from(LEASE_S) - 1);
    let transfer_to = async |worker: &str| {
        f.store
            .transfer_lease(&claim, worker, LEASE_S, f.now)
            .await
            .unwrap()
    };
    assert!(transfer_to("worker 1").await);
    assert!(!transfer_to("worker 2").await);
    assert!(
        transfer_to("worker 1").await,
        "the same worker can repeat the call, since a response can get lost"
    );
    let store = f.store.clone();
    let is_leased = async || store.is_leased(claim.job, claim.nonce).await.unwrap();
    assert!(is_leased().await);
    assert_eq!(
        f.store.end_leases_of("reserved", f.now).await.unwrap(),
        0,
        "another worker holds the lease"
    );
    assert_eq!(
        f.store.release_leases_of("reserved", f.now).await.unwrap(),
        0,
        "another worker holds the lease"
    );
    // A job that was started cannot be released. A job that was not started is returned to the queue.
    let release_unstarted =
        async |claim: &JobClaim| f.store.release_unstarted(claim, f.now).await.unwrap();
    assert!(!release_unstarted(&claim).await);
    assert!(is_leased().await);
    let claimed = f.store.claim("reserved", LEASE_S, f.now).await;
    let unstarted = claimed.unwrap().unwrap().claim;
    assert!(release_unstarted(&unstarted).await);
    assert!(
        !release_unstarted(&unstarted).await,
        "a job is released once"
    );
    let next = f.claim().await.unwrap().claim;
    assert_eq!(next.job, unstarted.job);
    f.store.release(&next, f.now).await.unwrap();
    // The transfer renewed the lease.
    f.advance_clock_s(i64::from(LEASE_S) - 1);
    let mut claimed_jobs = Vec::new();
    while let Some(claimed) = f.claim().await {
        claimed_jobs.push(claimed.claim.job);
    }
    assert!(!claimed_jobs.contains(&claim.job));
    f.store.release(&claim, f.now).await.unwrap();
    assert!(!is_leased().await);
    assert!(
        !f.store
            .transfer_lease(&claim, "late", LEASE_S, f.now)
            .await
            .unwrap()
    );
}

#[tokio::test]
async fn leases_of_killed_worker_end_at_once() {
    let f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let mut claims = Vec::new();
    for worker in ["old/slot-0", "old/slot-1", "older/slot-0", "old"] {
        let claimed = f
            .store
            .claim(worker, LEASE_S, f.now)
            .await
            .unwrap()
            .unwrap();
        claims.push(claimed.claim.clone());
    }
    assert_eq!(f.store.end_leases_of("old", f.now).await.unwrap(), 3);
    assert_eq!(f.store.end_leases_of("old", f.now).await.unwrap(), 0);
    let mut reclaimed = Vec::new();
    while let Some(claimed) = f.claim().await {
        reclaimed.push(claimed.claim.job);
    }
    assert_eq!(
        reclaimed.len(),
        5,
        "three jobs of the killed worker and two unclaimed ones"
    );
    assert!(!reclaimed.contains(&claims[2].job));
    assert!(
        f.store
            .heartbeat(&claims[2], 0, LEASE_S, f.now)
            .await
            .unwrap()
    );
}

#[tokio::test]
async fn late_commit_counts_without_a_new_lease() {
    let mut f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.advance_clock_s(3600);
    assert_eq!(f.commit_shard(&claim, &shard).await, CommitOutcome::Stored);
}

#[tokio::test]
async fn second_commit_changes_nothing() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    assert_eq!(f.commit_shard(&claim, &shard).await, CommitOutcome::Stored);
    let mut different = shard_commit(&shard, 2);
    different.recording = Some("recordings/other".into());
    let repeated = f
        .store
        .commit_shard(&claim, different, f.now)
        .await
        .unwrap();
    assert_eq!(repeated, CommitOutcome::AlreadyStored);
    let stored = f.store.outcomes(evaluation.run).await.unwrap();
    assert_eq!(stored, shard_commit(&shard, 0).outcomes);
    let shards = f.store.shards(evaluation.run).await.unwrap();
    let stored = shards.iter().find(|stored| stored.id == shard.id).unwrap();
    assert_eq!(stored.recording, shard_commit(&shard, 0).recording);
    assert!(!f.store.heartbeat(&claim, 2, LEASE_S, f.now).await.unwrap());
}

#[tokio::test]
async fn outcomes_must_cover_their_shard() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    let complete = shard_commit(&shard, 0);
    let mut without_last = complete.clone();
    without_last.outcomes.pop();
    let mut swapped = complete.clone();
    swapped.outcomes.swap(0, 1);
    let mut of_other_task = complete.clone();
    of_other_task.outcomes[0].task = if shard.task == PREPARE { HIT } else { PREPARE };
    for bad in [without_last, swapped, of_other_task] {
        let error = f.store.commit_shard(&claim, bad, f.now).await.unwrap_err();
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    }
    assert!(f.store.outcomes(evaluation.run).await.unwrap().is_empty());
    assert_eq!(
        f.store.commit_shard(&claim, complete, f.now).await.unwrap(),
        CommitOutcome::Stored
    );
}

#[tokio::test]
async fn queued_scoring_and_validation_run_before_next_shard() {
    let f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    let one_shard = one_shard_plan();
    let first = f.evaluate(alpha.id, &one_shard).await;
    f.evaluate(beta.id, &one_shard).await;
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(
        run.id, first.run,
        "evaluations are run in the order of their submissions"
    );
    f.commit_shard(&claim, &shard).await;
    let team = f.create_team("Gamma").await;
    f.upload(&team).await;
    f.claim_scoring().await;
    f.claim_validation().await;
    f.claim_shard().await;
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn job_released_at_shutdown_loses_no_attempt() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let submission = f.upload(&team).await;
    for _ in 0..2 * MAX_LEASES {
        let (claim, _) = f.claim_validation().await;
        f.store.release(&claim, f.now).await.unwrap();
    }
    let state = f.store.submission(submission.id).await.unwrap().state;
    assert_eq!(state, SubmissionState::Validating);
}

#[tokio::test]
async fn platform_faults_pause_shard_then_rerun_evaluation() {
    let mut f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (first_claim, _, shard) = f.claim_shard().await;
    f.store
        .release_after_platform_fault(&first_claim, "disk full", f.now)
        .await
        .unwrap();
    // The claims of the other five of the six shards.
    let mut open = Vec::new();
    for _ in 1..6 {
        let (claim, _, other) = f.claim_shard().await;
        assert_ne!(other.id, shard.id, "the failed shard pauses");
        open.push(claim);
    }
    assert!(f.claim().await.is_none());
    for failure in 2..=MAX_PLATFORM_FAULTS {
        f.advance_clock_s(60);
        for claim in &open {
            assert!(f.store.heartbeat(claim, 0, 1000, f.now).await.unwrap());
        }
        let (claim, _, repeated) = f.claim_shard().await;
        assert_eq!(repeated.id, shard.id);
        assert!(
            !f.state(evaluation.id).await.is_over(),
            "before failure {failure}"
        );
        f.store
            .release_after_platform_fault(&claim, "disk full", f.now)
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
    assert!(f.claim().await.is_none(), "the rerun pauses");
    f.advance_clock_s(i64::from(RERUN_PAUSES_S[0]));
    let (_, run, first) = f.claim_shard().await;
    assert_ne!(run.id, evaluation.run);
    assert_eq!(
        (run.plan, run.seed),
        (six_shard_plan(), SeedLabel::StageDay(evaluation.stage_day))
    );
    assert_eq!(first.recording, None);
}

#[tokio::test]
async fn failed_scoring_reruns_the_evaluation() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let one_shard = one_shard_plan();
    let evaluation = f.evaluate(submission.id, &one_shard).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    for _ in 0..MAX_PLATFORM_FAULTS {
        let (claim, _) = f.claim_scoring().await;
        f.store
            .release_after_platform_fault(&claim, "no space left", f.now)
            .await
            .unwrap();
        assert_eq!(
            f.finish_scoring(&claim, 1.0, DATASET_KEY).await,
            CommitOutcome::LeaseLost
        );
        f.advance_clock_s(60);
    }
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed { .. }
    ));
    let (_, run, _) = f.claim_shard().await;
    assert_ne!(run.id, evaluation.run);
}

#[tokio::test]
async fn failed_validation_run_ends_as_platform_fault() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let submission = f.upload(&team).await;
    for _ in 0..MAX_PLATFORM_FAULTS {
        let (claim, submission) = f.claim_validation().await;
        assert_eq!(submission.state, SubmissionState::Validating);
        f.store
            .release_after_platform_fault(&claim, "no cgroup", f.now)
            .await
            .unwrap();
        f.advance_clock_s(60);
    }
    let state = f.store.submission(submission.id).await.unwrap().state;
    assert_eq!(
        state,
        SubmissionState::PlatformFailed {
            reason: "no cgroup".into()
        }
    );
    assert!(f.claim().await.is_none());
}

#[tokio::test]
async fn job_fails_after_too_many_expired_leases() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let one_shard = one_shard_plan();
    let evaluation = f.evaluate(submission.id, &one_shard).await;
    for _ in 0..MAX_LEASES {
        f.claim_shard().await;
        f.advance_clock_s(i64::from(LEASE_S));
    }
    assert!(f.claim().await.is_none());
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::PlatformFailed { .. }
    ));
}
