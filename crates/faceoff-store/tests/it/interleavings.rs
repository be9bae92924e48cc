//! For any order of actions of workers, which claim (lease) the jobs of an evaluation: every shard (group of episodes that are
//! run together) of a finished evaluation has exactly one committed result.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::ShardId;
use proptest::prelude::*;
use std::collections::HashMap;

/// Episodes of [`six_shard_plan`].
const EPISODES: usize = 12;

/// Action of a worker. Its number selects one of all earlier claims, including those whose leases have expired.
#[derive(Debug, Clone)]
enum Action {
    Claim,
    Commit(usize),
    Heartbeat(usize),
    Fail(usize),
    Release(usize),
    /// Advances the clock by this number of seconds.
    Wait(i64),
    /// Opens the store again.
    Restart,
}

/// A random action; in front of each its relative frequency.
fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        6 => Just(Action::Claim),
        5 => any::<usize>().prop_map(Action::Commit),
        2 => any::<usize>().prop_map(Action::Heartbeat),
        2 => any::<usize>().prop_map(Action::Fail),
        1 => any::<usize>().prop_map(Action::Release),
        3 => (1..40_i64).prop_map(Action::Wait),
        1 => Just(Action::Restart),
    ]
}

/// What the workers have done.
#[derive(Default)]
struct History {
    claims: Vec<ClaimedJob>,
    /// Number of stored commits of each shard.
    commits: HashMap<ShardId, u32>,
}

impl History {
    /// The claim that this number selects.
    fn select(&self, number: usize) -> Option<&ClaimedJob> {
        self.claims.get(number.checked_rem(self.claims.len())?)
    }

    async fn commit(&mut self, f: &TestStore, number: usize) {
        let Some(ClaimedJob { claim, job }) = self.select(number).cloned() else {
            return;
        };
        match job {
            Job::Shard { shard, .. } => {
                if f.commit_shard(&claim, &shard).await == CommitOutcome::Stored {
                    *self.commits.entry(shard.id).or_default() += 1;
                }
            }
            Job::Scoring { .. } => {
                f.finish_scoring(&claim, 1.0, DATASET_KEY).await;
            }
            Job::Validation { .. } | Job::Game { .. } => {
                unreachable!("the only validation run is over")
            }
        }
    }
}

async fn run_actions(actions: Vec<Action>) {
    let mut f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let mut history = History::default();
    for action in actions {
        match action {
            Action::Claim => {
                if let Some(claimed) = f.claim().await {
                    history.claims.push(claimed);
                }
            }
            Action::Commit(number) => history.commit(&f, number).await,
            Action::Heartbeat(number) => {
                if let Some(ClaimedJob { claim, .. }) = history.select(number) {
                    f.store.heartbeat(claim, 1, LEASE_S, f.now).await.unwrap();
                }
            }
            Action::Fail(number) => {
                if let Some(ClaimedJob { claim, .. }) = history.select(number) {
                    f.store
                        .release_after_platform_fault(claim, "a platform fault", f.now)
                        .await
                        .unwrap();
                }
            }
            Action::Release(number) => {
                if let Some(ClaimedJob { claim, .. }) = history.select(number) {
                    f.store.release(claim, f.now).await.unwrap();
                }
            }
            Action::Wait(seconds) => f.advance_clock_s(seconds),
            Action::Restart => f.store = f.reopen().await,
        }
    }
    // A worker without failures ends the evaluation in any case.
    f.advance_clock_s(3600);
    while let Some(claimed) = f.claim().await {
        history.claims.push(claimed);
        history.commit(&f, history.claims.len() - 1).await;
    }
    let state = f.state(evaluation.id).await;
    let shards = f.store.shards(evaluation.run).await.unwrap();
    match state {
        EvaluationState::Finished { .. } => {
            for shard in &shards {
                assert_eq!(history.commits.get(&shard.id), Some(&1), "{shard:?}");
                assert!(shard.recording.is_some());
            }
            assert_eq!(
                f.store.outcomes(evaluation.run).await.unwrap().len(),
                EPISODES
            );
        }
        EvaluationState::PlatformFailed { .. } => {
            assert!(shards.iter().all(|shard| {
                history
                    .commits
                    .get(&shard.id)
                    .is_none_or(|count| *count == 1)
            }));
        }
        other => panic!("the evaluation has not ended: {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..Default::default() })]

    #[test]
    fn shards_are_committed_exactly_once(actions in prop::collection::vec(action(), 0..60)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(run_actions(actions));
    }
}
