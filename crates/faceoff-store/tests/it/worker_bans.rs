//! Bans of remote workers (processes on other machines that run jobs): a banned worker's results are rejected, and its shards
//! of open runs are run again. A job's lease names the worker's slot as its holder, for example `remote/rack-1/slot-0`.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::WorkerName;

const REASON: &str = "its numbers are not the simulator's";

fn worker(name: &str) -> WorkerName {
    name.parse().unwrap()
}

/// Claims a shard, as the server does for a remote worker.
async fn claim_for(f: &TestStore, holder: &str) -> (JobClaim, Shard) {
    let claimed = f.store.claim(holder, LEASE_S, f.now).await.unwrap();
    let claimed = claimed.expect("a job is queued");
    let Job::Shard { shard, .. } = claimed.job else {
        panic!("expected a shard, claimed {:?}", claimed.job);
    };
    (claimed.claim, shard)
}

#[tokio::test]
async fn ban_requeues_shards_of_open_runs() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    // A worker with a similar name and the server's own slot are not affected.
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    assert_eq!(
        f.commit_shard(&own, &own_shard).await,
        CommitOutcome::Stored
    );
    let (similar, similar_shard) = claim_for(&f, "remote/rack-10/slot-0").await;
    assert_eq!(
        f.commit_shard(&similar, &similar_shard).await,
        CommitOutcome::Stored
    );
    let (banned, banned_shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    assert_eq!(
        f.commit_shard_with_faults(&banned, &banned_shard, 1).await,
        CommitOutcome::Stored
    );
    let (running, running_shard) = claim_for(&f, "remote/rack-1/slot-1").await;

    let rack = worker("rack-1");
    let ban = f.store.ban_worker(Actor::Server, &rack, REASON, f.now);
    assert_eq!(ban.await.unwrap(), 1, "one shard is run again");
    let bans = f.store.worker_bans().await.unwrap();
    assert_eq!((&*bans[0].worker, &*bans[0].reason), ("rack-1", REASON));
    let ban_reason = async |name: &str| f.store.ban_reason(&worker(name)).await.unwrap();
    assert_eq!(ban_reason("rack-1").await.as_deref(), Some(REASON));
    assert_eq!(ban_reason("rack-10").await, None);
    let repeated = f.store.ban_worker(Actor::Operator, &rack, REASON, f.now);
    assert!(matches!(repeated.await, Err(StoreError::Conflict(_))));

    // The banned worker's late outcomes change nothing, and other workers run both shards again.
    assert_eq!(
        f.commit_shard(&banned, &banned_shard).await,
        CommitOutcome::LeaseLost
    );
    let mut remaining_shards = vec![banned_shard.id, running_shard.id];
    while let Some(claimed) = f.store.claim("slot-0", LEASE_S, f.now).await.unwrap() {
        match claimed.job {
            Job::Shard { shard, .. } => {
                remaining_shards.retain(|id| *id != shard.id);
                assert_eq!(
                    f.commit_shard(&claimed.claim, &shard).await,
                    CommitOutcome::Stored
                );
            }
            Job::Scoring { .. } => {
                let finished = f
                    .finish_scoring(&claimed.claim, 0.5, "datasets/alpha")
                    .await;
                assert_eq!(finished, CommitOutcome::Stored);
                break;
            }
            other => panic!("expected a shard or a scoring job, claimed {other:?}"),
        }
    }
    assert!(remaining_shards.is_empty(), "{remaining_shards:?}");
    assert_eq!(
        f.commit_shard(&running, &running_shard).await,
        CommitOutcome::LeaseLost
    );
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::Finished { .. }
    ));
    // Finished evaluations are listed for each worker that ran a shard of them.
    let results = async |name: &str| f.store.results_of_worker(&worker(name), 100).await.unwrap();
    assert_eq!(results("rack-1").await, WorkerResults::default());
    assert_eq!(results("rack-10").await.evaluations, [evaluation.id]);

    // The worker is banned for another process, too, until it is readmitted.
    let other = f.reopen().await;
    assert_eq!(other.worker_bans().await.unwrap(), bans);
    let readmit = async || {
        f.store
            .readmit_worker(Actor::Operator, &worker("rack-1"), f.now)
            .await
    };
    readmit().await.unwrap();
    assert_eq!(ban_reason("rack-1").await, None);
    assert!(matches!(readmit().await, Err(StoreError::Conflict(_))));
    assert!(other.worker_bans().await.unwrap().is_empty());
}

#[tokio::test]
async fn remote_leases_survive_a_server_restart() {
    let mut f = TestStore::new().await;
    f.start_evaluation(&six_shard_plan()).await;
    let (remote, shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    let (unstarted, _) = claim_for(&f, "reserved").await;
    f.advance_clock_s(i64::from(LEASE_S) + 5);
    // Leases of unstarted jobs end, remote leases are renewed, and the server's own leases are unchanged.
    assert_eq!(
        f.store.release_leases_of("reserved", f.now).await.unwrap(),
        1
    );
    assert_eq!(
        f.store.renew_leases_of("remote", 60, f.now).await.unwrap(),
        1
    );
    let mut claimed_jobs = Vec::new();
    while let Some(claimed) = f.store.claim("slot-1", LEASE_S, f.now).await.unwrap() {
        claimed_jobs.push(claimed.claim.job);
    }
    assert!(claimed_jobs.contains(&unstarted.job) && claimed_jobs.contains(&own.job));
    assert!(!claimed_jobs.contains(&remote.job));
    assert_eq!(
        f.commit_shard(&own, &own_shard).await,
        CommitOutcome::LeaseLost
    );
    assert_eq!(f.commit_shard(&remote, &shard).await, CommitOutcome::Stored);
    let is_leased_by = async |name: &str| {
        let worker = worker(name);
        f.store
            .is_leased_by(&worker, remote.job, remote.nonce)
            .await
            .unwrap()
    };
    assert!(!is_leased_by("rack-1").await, "the job is done");
}
