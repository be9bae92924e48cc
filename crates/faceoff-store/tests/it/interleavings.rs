//! Whatever workers do and in whatever order, every shard ends with exactly one committed result.

use crate::fixture::*;
use faceoff_store::*;
use proptest::prelude::*;
use std::collections::HashMap;
use uuid::Uuid;

/// What a worker may do; the number picks one of the claims ever given, lost ones included.
#[derive(Debug, Clone)]
enum Act {
    Claim,
    Commit(usize),
    Heartbeat(usize),
    Fail(usize),
    Release(usize),
    Wait(i64),
    Restart,
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        6 => Just(Act::Claim),
        5 => any::<usize>().prop_map(Act::Commit),
        2 => any::<usize>().prop_map(Act::Heartbeat),
        2 => any::<usize>().prop_map(Act::Fail),
        1 => any::<usize>().prop_map(Act::Release),
        3 => (1..40_i64).prop_map(Act::Wait),
        1 => Just(Act::Restart),
    ]
}

#[derive(Default)]
struct Played {
    claims: Vec<(Claim, Work)>,
    /// commits that were told "now", per unit
    commits: HashMap<Uuid, u32>,
}

impl Played {
    fn pick(&self, number: usize) -> Option<&(Claim, Work)> {
        self.claims.get(number.checked_rem(self.claims.len())?)
    }

    async fn commit(&mut self, f: &Fixture, number: usize) {
        let Some((claim, work)) = self.pick(number).cloned() else {
            return;
        };
        let now = match work {
            Work::Shard { shard, .. } => {
                let told = f
                    .store
                    .commit_shard(&claim, commit(&shard, 0), f.now)
                    .await
                    .unwrap();
                told == Committed::Now
            }
            Work::Finalise { .. } => {
                match f
                    .store
                    .finish_evaluation(&claim, &result(1.0), "d", f.now)
                    .await
                {
                    Ok(()) => true,
                    Err(StoreError::Conflict(_)) => false,
                    Err(error) => panic!("{error}"),
                }
            }
            Work::Smoke { .. } | Work::Ablation { .. } => {
                unreachable!("the only smoke run is over, and no ablation was ordered")
            }
        };
        if now {
            *self.commits.entry(claim.unit).or_default() += 1;
        }
    }
}

async fn play(acts: Vec<Act>) {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f
        .store
        .create_evaluation(submission.id, &plan(), f.now)
        .await
        .unwrap();
    let mut played = Played::default();
    for act in acts {
        match act {
            Act::Claim => {
                if let Some(work) = f.claim().await {
                    played.claims.push((work.claim().clone(), work));
                }
            }
            Act::Commit(number) => played.commit(&f, number).await,
            Act::Heartbeat(number) => {
                if let Some((claim, _)) = played.pick(number) {
                    f.store.heartbeat(claim, 1, LEASE_S, f.now).await.unwrap();
                }
            }
            Act::Fail(number) => {
                if let Some((claim, _)) = played.pick(number) {
                    f.store
                        .release_failed(claim, "a fault of ours", f.now)
                        .await
                        .unwrap();
                }
            }
            Act::Release(number) => {
                if let Some((claim, _)) = played.pick(number) {
                    f.store.release(claim, f.now).await.unwrap();
                }
            }
            Act::Wait(seconds) => f.later(seconds),
            Act::Restart => f.store = f.reopen().await,
        }
    }
    // a healthy worker comes along: whatever happened, the evaluation ends
    f.later(3600);
    while let Some(work) = f.claim().await {
        played.claims.push((work.claim().clone(), work));
        played.commit(&f, played.claims.len() - 1).await;
    }
    let state = f.state(evaluation.id).await;
    let shards = f.store.shards(evaluation.id).await.unwrap();
    match state {
        EvaluationState::Finished { .. } => {
            for shard in &shards {
                assert_eq!(
                    played.commits.get(&shard.id.as_uuid()),
                    Some(&1),
                    "{shard:?}"
                );
                assert!(shard.recording.is_some());
            }
            assert_eq!(f.store.outcomes(evaluation.id).await.unwrap().len(), 12);
        }
        EvaluationState::PlatformFailed { .. } => {
            assert!(
                shards
                    .iter()
                    .all(|s| played.commits.get(&s.id.as_uuid()).is_none_or(|n| *n == 1))
            );
        }
        other => panic!("the evaluation is stuck: {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..Default::default() })]

    #[test]
    fn every_shard_is_committed_once(acts in prop::collection::vec(act(), 0..60)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(play(acts));
    }
}
