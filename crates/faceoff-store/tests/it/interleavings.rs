//! Whatever workers do and in whatever order, every shard ends with exactly one committed result.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::ShardId;
use proptest::prelude::*;
use std::collections::HashMap;

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
    claims: Vec<Claimed>,
    /// commits that were told "now", per shard
    commits: HashMap<ShardId, u32>,
}

impl Played {
    fn pick(&self, number: usize) -> Option<&Claimed> {
        self.claims.get(number.checked_rem(self.claims.len())?)
    }

    async fn commit(&mut self, f: &Fixture, number: usize) {
        let Some(Claimed { claim, work }) = self.pick(number).cloned() else {
            return;
        };
        match work {
            Work::Shard { shard, .. } => {
                if f.play(&claim, &shard, 0).await == Committed::Now {
                    *self.commits.entry(shard.id).or_default() += 1;
                }
            }
            Work::Finalise { .. } => {
                f.finish(&claim, 1.0, "d").await;
            }
            Work::Smoke { .. } | Work::Game { .. } => unreachable!("the only smoke run is over"),
        }
    }
}

async fn play(acts: Vec<Act>) {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let mut played = Played::default();
    for act in acts {
        match act {
            Act::Claim => {
                if let Some(work) = f.claim().await {
                    played.claims.push(work);
                }
            }
            Act::Commit(number) => played.commit(&f, number).await,
            Act::Heartbeat(number) => {
                if let Some(Claimed { claim, .. }) = played.pick(number) {
                    f.store.heartbeat(claim, 1, LEASE_S, f.now).await.unwrap();
                }
            }
            Act::Fail(number) => {
                if let Some(Claimed { claim, .. }) = played.pick(number) {
                    f.store
                        .release_failed(claim, "a fault of ours", f.now)
                        .await
                        .unwrap();
                }
            }
            Act::Release(number) => {
                if let Some(Claimed { claim, .. }) = played.pick(number) {
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
        played.claims.push(work);
        played.commit(&f, played.claims.len() - 1).await;
    }
    let state = f.state(evaluation.id).await;
    let shards = f.store.shards(evaluation.run).await.unwrap();
    match state {
        EvaluationState::Finished { .. } => {
            for shard in &shards {
                assert_eq!(played.commits.get(&shard.id), Some(&1), "{shard:?}");
                assert!(shard.recording.is_some());
            }
            assert_eq!(f.store.outcomes(evaluation.run).await.unwrap().len(), 12);
        }
        EvaluationState::PlatformFailed { .. } => {
            assert!(
                shards
                    .iter()
                    .all(|s| played.commits.get(&s.id).is_none_or(|n| *n == 1))
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
