//! Banned remote workers.

use crate::fixture::*;
use faceoff_store::*;

const REASON: &str = "its numbers are not the simulator's";

fn worker(name: &str) -> WorkerName {
    name.parse().unwrap()
}

/// Claims a shard, as the server does for a remote worker.
async fn claim_for(f: &TestStore, holder: &str) -> (JobClaim, Shard) {
    let claimed = f.store.claim(holder, LEASE_S, f.now).await.unwrap();
    let claimed = claimed.expect("a job is queued");
    let Job::Shard { shard, .. } = claimed.job else {
        panic!("{:?}", claimed.job);
    };
    (claimed.claim, shard)
}

#[tokio::test]
async fn ban_requeues_shards_of_open_runs() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    // A worker with a similar name and the server's own slot are not affected.
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    assert_eq!(
        f.commit_shard(&own, &own_shard, 0).await,
        CommitOutcome::Stored
    );
    let (similar, similar_shard) = claim_for(&f, "remote/rack-10/slot-0").await;
    assert_eq!(
        f.commit_shard(&similar, &similar_shard, 0).await,
        CommitOutcome::Stored
    );
    let (banned, banned_shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    assert_eq!(
        f.commit_shard(&banned, &banned_shard, 1).await,
        CommitOutcome::Stored
    );
    let (running, running_shard) = claim_for(&f, "remote/rack-1/slot-1").await;

    let rack = worker("rack-1");
    let ban = f.store.ban_worker(Actor::Server, &rack, REASON, f.now);
    assert_eq!(ban.await.unwrap(), 1, "one shard is run again");
    let bans = f.store.worker_bans().await.unwrap();
    assert_eq!((&*bans[0].worker, &*bans[0].reason), ("rack-1", REASON));
    assert_eq!(
        f.store.workers().ban_reason("rack-1").as_deref(),
        Some(REASON),
        "the ban is cached"
    );
    assert_eq!(f.store.workers().ban_reason("rack-10"), None);
    let repeated = f.store.ban_worker(Actor::Organiser, &rack, REASON, f.now);
    assert!(matches!(repeated.await, Err(StoreError::Conflict(_))));

    // Its late outcomes change nothing, and both shards go to other workers.
    assert_eq!(
        f.commit_shard(&banned, &banned_shard, 0).await,
        CommitOutcome::LeaseLost
    );
    let mut left = vec![banned_shard.id, running_shard.id];
    while let Some(claimed) = f.store.claim("slot-0", LEASE_S, f.now).await.unwrap() {
        match claimed.job {
            Job::Shard { shard, .. } => {
                left.retain(|id| *id != shard.id);
                assert_eq!(
                    f.commit_shard(&claimed.claim, &shard, 0).await,
                    CommitOutcome::Stored
                );
            }
            Job::Scoring { .. } => {
                let done = f.finish(&claimed.claim, 0.5, "datasets/alpha").await;
                assert_eq!(done, CommitOutcome::Stored);
                break;
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(left.is_empty(), "{left:?}");
    assert_eq!(
        f.commit_shard(&running, &running_shard, 0).await,
        CommitOutcome::LeaseLost
    );
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::Finished { .. }
    ));
    // Finished results with a part of a worker are listed.
    let results = async |name: &str| f.store.results_of_worker(&worker(name), 100).await.unwrap();
    assert_eq!(results("rack-1").await, WorkerResults::default());
    assert_eq!(results("rack-10").await.evaluations, [evaluation.id]);

    // It stays banned for another process, until it is readmitted.
    let other = f.reopen().await;
    assert_eq!(other.worker_bans().await.unwrap(), bans);
    let readmit = async || {
        f.store
            .readmit_worker(Actor::Organiser, &worker("rack-1"), f.now)
            .await
    };
    readmit().await.unwrap();
    assert_eq!(f.store.workers().ban_reason("rack-1"), None);
    assert!(matches!(readmit().await, Err(StoreError::Conflict(_))));
    assert!(other.worker_bans().await.unwrap().is_empty());
}

#[tokio::test]
async fn remote_leases_survive_a_server_restart() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await;
    let (remote, shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    let (unstarted, _) = claim_for(&f, "reserved").await;
    f.later(i64::from(LEASE_S) + 5);
    // Leases of unstarted jobs end, remote leases are renewed, and the server's own leases are unchanged.
    assert_eq!(
        f.store.release_leases_of("reserved", f.now).await.unwrap(),
        1
    );
    assert_eq!(
        f.store.renew_leases_of("remote", 60, f.now).await.unwrap(),
        1
    );
    let mut next = Vec::new();
    while let Some(claimed) = f.store.claim("slot-1", LEASE_S, f.now).await.unwrap() {
        next.push(claimed.claim.job);
    }
    assert!(next.contains(&unstarted.job) && next.contains(&own.job));
    assert!(!next.contains(&remote.job));
    assert_eq!(
        f.commit_shard(&own, &own_shard, 0).await,
        CommitOutcome::LeaseLost
    );
    assert_eq!(
        f.commit_shard(&remote, &shard, 0).await,
        CommitOutcome::Stored
    );
    let is_leased_by = async |name: &str| {
        let worker = worker(name);
        f.store
            .is_leased_by(&worker, remote.job, remote.nonce)
            .await
            .unwrap()
    };
    assert!(!is_leased_by("rack-1").await, "the job is done");
}

#[test]
fn worker_names_are_valid_subject_tokens() {
    for name in ["", "a.b", "a b", "*", ">", "a/b", &"x".repeat(65)] {
        let refused = name.parse::<WorkerName>().unwrap_err();
        assert!(refused.to_string().contains("1 to 64"), "{name:?}");
    }
    assert_eq!(worker("rack-1_b").holder(), "remote/rack-1_b");
}
