//! Workers elsewhere of which nothing is taken.

use crate::fixture::*;
use faceoff_store::*;

const WHY: &str = "its numbers are not the simulator's";

fn worker(name: &str) -> WorkerName {
    name.parse().unwrap()
}

/// Claims a shard, as the server does for a worker elsewhere.
async fn claim_for(f: &Fixture, holder: &str) -> (Claim, Shard) {
    let claimed = f.store.claim(holder, LEASE_S, f.now).await.unwrap();
    let claimed = claimed.expect("there is work");
    let Work::Shard { shard, .. } = claimed.work else {
        panic!("{:?}", claimed.work);
    };
    (claimed.claim, shard)
}

#[tokio::test]
async fn what_a_banned_worker_played_of_runs_that_go_on_is_played_again() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    // One that is called alike is not meant, nor is the server's own slot.
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    assert_eq!(f.play(&own, &own_shard, 0).await, Committed::Now);
    let (alike, alike_shard) = claim_for(&f, "remote/rack-10/slot-0").await;
    assert_eq!(f.play(&alike, &alike_shard, 0).await, Committed::Now);
    let (lied, lied_shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    assert_eq!(f.play(&lied, &lied_shard, 1).await, Committed::Now);
    let (begun, begun_shard) = claim_for(&f, "remote/rack-1/slot-1").await;

    let rack = worker("rack-1");
    let ban = f.store.ban_worker(Actor::Server, &rack, WHY, f.now);
    assert_eq!(ban.await.unwrap(), 1, "one shard is played again");
    let bans = f.store.worker_bans().await.unwrap();
    assert_eq!((&*bans[0].worker, &*bans[0].reason), ("rack-1", WHY));
    assert_eq!(
        f.store.workers().ban_of("rack-1").as_deref(),
        Some(WHY),
        "without a look at the database"
    );
    assert_eq!(f.store.workers().ban_of("rack-10"), None);
    let again = f.store.ban_worker(Actor::Organiser, &rack, WHY, f.now);
    assert!(matches!(again.await, Err(StoreError::Conflict(_))));

    // Its late outcomes change nothing, and both shards are another's.
    assert_eq!(f.play(&lied, &lied_shard, 0).await, Committed::LeaseLost);
    let mut left = vec![lied_shard.id, begun_shard.id];
    while let Some(claimed) = f.store.claim("slot-0", LEASE_S, f.now).await.unwrap() {
        match claimed.work {
            Work::Shard { shard, .. } => {
                left.retain(|id| *id != shard.id);
                assert_eq!(f.play(&claimed.claim, &shard, 0).await, Committed::Now);
            }
            Work::Finalise { .. } => {
                let done = f.finish(&claimed.claim, 0.5, "datasets/alpha").await;
                assert_eq!(done, Committed::Now);
                break;
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(left.is_empty(), "{left:?}");
    assert_eq!(f.play(&begun, &begun_shard, 0).await, Committed::LeaseLost);
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::Finished { .. }
    ));
    // What is over and has a part of somebody's is told.
    let played = async |name: &str| f.store.played_by(&worker(name), 100).await.unwrap();
    assert_eq!(played("rack-1").await, PlayedBy::default());
    assert_eq!(played("rack-10").await.evaluations, [evaluation.id]);

    // It stays banned for another process, until it is readmitted.
    let other = f.reopen().await;
    assert_eq!(other.worker_bans().await.unwrap(), bans);
    let readmit = async || {
        f.store
            .readmit_worker(Actor::Organiser, &worker("rack-1"), f.now)
            .await
    };
    readmit().await.unwrap();
    assert_eq!(f.store.workers().ban_of("rack-1"), None);
    assert!(matches!(readmit().await, Err(StoreError::Conflict(_))));
    assert!(other.worker_bans().await.unwrap().is_empty());
}

#[tokio::test]
async fn what_workers_elsewhere_hold_outlives_a_server_that_was_away() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await;
    let (elsewhere, shard) = claim_for(&f, "remote/rack-1/slot-0").await;
    let (own, own_shard) = claim_for(&f, "slot-0").await;
    let (unbegun, _) = claim_for(&f, "given out").await;
    f.later(i64::from(LEASE_S) + 5);
    // What nobody has begun goes back, what others play is theirs for another while; the server's own is as it was.
    assert_eq!(
        f.store.give_back_all_of("given out", f.now).await.unwrap(),
        1
    );
    assert_eq!(
        f.store.renew_leases_of("remote", 60, f.now).await.unwrap(),
        1
    );
    let mut next = Vec::new();
    while let Some(claimed) = f.store.claim("slot-1", LEASE_S, f.now).await.unwrap() {
        next.push(claimed.claim.unit);
    }
    assert!(next.contains(&unbegun.unit) && next.contains(&own.unit));
    assert!(!next.contains(&elsewhere.unit));
    assert_eq!(f.play(&own, &own_shard, 0).await, Committed::LeaseLost);
    assert_eq!(f.play(&elsewhere, &shard, 0).await, Committed::Now);
    let is_of = async |name: &str| {
        let worker = worker(name);
        f.store
            .is_of(&worker, elsewhere.unit, elsewhere.nonce)
            .await
            .unwrap()
    };
    assert!(!is_of("rack-1").await, "it is done");
}

#[test]
fn names_are_tokens_of_subjects() {
    for name in ["", "a.b", "a b", "*", ">", "a/b", &"x".repeat(65)] {
        let refused = name.parse::<WorkerName>().unwrap_err();
        assert!(refused.to_string().contains("1 to 64"), "{name:?}");
    }
    assert_eq!(worker("rack-1_b").holder(), "remote/rack-1_b");
}
