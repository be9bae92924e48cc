//! A job knows how many earlier attempts ended by a platform fault.

use crate::fixture::*;
use faceoff_store::*;

async fn claimed(f: &TestStore) -> (JobClaim, u32) {
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
    let submission = f.ready_team("Alpha").await;
    let whole = RunPlan {
        tasks: vec![faceoff_types::Task::Hit],
        episodes_per_shard: plan().episodes_per_task,
        ..plan()
    };
    f.evaluate(submission.id, &whole).await;
    let (claim, retries) = claimed(&f).await;
    assert_eq!(retries, 0);
    f.store.release(&claim, f.now).await.unwrap();
    let (claim, retries) = claimed(&f).await;
    assert_eq!(retries, 0, "a shutdown is no fault");

    let failed = f.store.release_failed(&claim, "disk full", f.now).await;
    failed.unwrap();
    f.later(3600);
    let (_, retries) = claimed(&f).await;
    assert_eq!(retries, 1, "a fault that was reported");
    f.later(3600);
    let (_, retries) = claimed(&f).await;
    assert_eq!(retries, 2, "a worker that died");
}
