//! A range of episodes that is begun again by our fault says so to whoever plays it.

use crate::fixture::*;
use faceoff_store::*;

async fn claimed(f: &Fixture) -> (Claim, u32) {
    match f.claim().await {
        Some(Claimed {
            claim,
            work: Work::Shard {
                platform_retries, ..
            },
        }) => (claim, platform_retries),
        other => panic!("expected a shard, claimed {other:?}"),
    }
}

#[tokio::test]
async fn what_we_broke_counts_and_a_shutdown_does_not() {
    let mut f = Fixture::new().await;
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
    assert_eq!(retries, 0, "a shutdown breaks nothing");

    let failed = f.store.release_failed(&claim, "disk full", f.now).await;
    failed.unwrap();
    f.later(3600);
    let (_, retries) = claimed(&f).await;
    assert_eq!(retries, 1, "a fault that was reported");
    f.later(3600);
    let (_, retries) = claimed(&f).await;
    assert_eq!(retries, 2, "a worker that died");
}
