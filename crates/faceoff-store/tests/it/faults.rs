//! Agent faults, summed over an evaluation's shards.

use crate::fixture::*;
use faceoff_store::*;

#[tokio::test]
async fn as_many_faults_as_allowed_are_scored() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    for faults in [2, 1, 0, 0, 0, 0] {
        let (claim, _, shard) = f.claim_shard().await;
        f.play(&claim, &shard, faults).await;
    }
    assert_eq!(f.state(evaluation.id).await, EvaluationState::Finalising);
}

#[tokio::test]
async fn one_fault_more_ends_the_evaluation_without_a_score() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (first, _, first_shard) = f.claim_shard().await;
    let (running, _, running_shard) = f.claim_shard().await;
    let (third, _, third_shard) = f.claim_shard().await;
    // committed out of order: the verdict lists them in order of play
    f.play(&third, &third_shard, 2).await;
    assert!(!f.state(evaluation.id).await.is_over());
    f.play(&first, &first_shard, 2).await;

    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::AgentFailed { finished_at: f.now },
        "four faults are one too many"
    );
    let RunFaults { faults, log } = f.store.run_faults(evaluation.run).await.unwrap();
    let places: Vec<_> = faults
        .iter()
        .map(|fault| (fault.contest, fault.episode))
        .collect();
    assert_eq!(
        places,
        [&first_shard, &third_shard]
            .map(|s| [0, 1].map(|i| (s.task.into(), Some(s.first_episode + i))))
            .concat()
    );
    assert!(
        log.contains("log of hit 0\n") && log.contains("log of defend 0\n"),
        "{log}"
    );

    assert!(
        !f.store
            .heartbeat(&running, 1, LEASE_S, f.now)
            .await
            .unwrap()
    );
    assert_eq!(
        f.play(&running, &running_shard, 0).await,
        Committed::LeaseLost
    );
    assert!(
        f.claim().await.is_none(),
        "the remaining shards are dropped"
    );
    assert!(f.board().await.is_empty());
    let again = f
        .store
        .rerun_evaluation(Actor::Organiser, evaluation.id, f.now)
        .await;
    assert!(
        matches!(again, Err(StoreError::Conflict(_))),
        "its own fault counts"
    );
}

#[tokio::test]
async fn a_shard_stopped_by_faults_ends_the_evaluation() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let strict = RunPlan {
        max_faults: 0,
        ..plan()
    };
    let evaluation = f.evaluate(submission.id, &strict).await;
    let (claim, _, shard) = f.claim_shard().await;
    let mut stopped = commit(&shard, 1);
    stopped.outcomes.truncate(1);
    stopped.stopped_by_faults = true;
    assert_eq!(
        f.store.commit_shard(&claim, stopped, f.now).await.unwrap(),
        Committed::Now
    );
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::AgentFailed { .. }
    ));
    let faults = f.store.run_faults(evaluation.run).await.unwrap().faults;
    assert_eq!(faults.len(), 1);
}
