//! A claimed job tells the worker how many of its earlier attempts ended by a platform fault (a full disk, a killed worker).

use crate::fixture::*;
use faceoff_store::*;

/// Claims the next shard. Returns its number of retries after platform faults, too.
async fn claim_shard_and_retries(f: &TestStore) -> (JobClaim, u32) {
    match f.claim().await {
        Some(ClaimedJob {
            claim,
            job: Job::Shard {
                platform_retries, ..
            },
        }) => (claim, platform_retries),
        other => panic!("expected a shard, claimed {other:?}"),
    }
}

#[tokio::test]
async fn platform_faults_count_as_retries_and_shutdowns_do_not() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let one_shard = RunPlan {
        episodes_per_shard: six_shard_plan().episodes_per_task,
        ..two_shard_plan()
    };
    f.evaluate(submission.id, &one_shard).await;
    let (claim, retries) = claim_shard_and_retries(&f).await;
    assert_eq!(retries, 0);
    f.store.release(&claim, f.now).await.unwrap();
    let (claim, retries) = claim_shard_and_retries(&f).await;
    assert_eq!(retries, 0, "a shutdown is no fault");

    let failed = f
        .store
        .release_after_platform_fault(&claim, "disk full", f.now)
        .await;
    failed.unwrap();
    f.advance_clock_s(3600);
    let (_, retries) = claim_shard_and_retries(&f).await;
    assert_eq!(retries, 1, "the worker reported a fault");
    f.advance_clock_s(3600);
    let (_, retries) = claim_shard_and_retries(&f).await;
    assert_eq!(retries, 2, "the worker's lease expired");
}
