//! Agent faults (wrong responses of the agent's process, each of which ends its episode), which are counted over all shards of
//! an evaluation. Above the plan's maximum, three, the evaluation ends without a score.

use crate::fixture::*;
use faceoff_airhockey::TASKS;
use faceoff_store::*;

#[tokio::test]
async fn evaluation_at_fault_limit_is_scored() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    // Faults of each of the six shards: three in all.
    for faults in [2, 1, 0, 0, 0, 0] {
        let (claim, _, shard) = f.claim_shard().await;
        f.commit_shard_with_faults(&claim, &shard, faults).await;
    }
    assert_eq!(f.state(evaluation.id).await, EvaluationState::Scoring);
}

#[tokio::test]
async fn evaluation_above_fault_limit_ends_without_score() {
    let f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (first, _, first_shard) = f.claim_shard().await;
    let (running, _, running_shard) = f.claim_shard().await;
    let (third, _, third_shard) = f.claim_shard().await;
    // The third shard is committed before the first; the faults are listed in the order of the shards.
    f.commit_shard_with_faults(&third, &third_shard, 2).await;
    assert!(!f.state(evaluation.id).await.is_over());
    f.commit_shard_with_faults(&first, &first_shard, 2).await;

    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::AgentFailed { finished_at: f.now },
        "four faults are one too many"
    );
    let RunFaults { faults, log } = f.store.run_faults(evaluation.run).await.unwrap();
    let places: Vec<_> = faults
        .iter()
        .map(|fault| (fault.agent_task, fault.episode))
        .collect();
    // In the order of tasks and episodes, whatever the order of play.
    let mut in_order = [&first_shard, &third_shard];
    in_order.sort_by_key(|shard| {
        let task = TASKS.iter().position(|task| *task == shard.task);
        (task, shard.first_episode)
    });
    assert_eq!(
        places,
        in_order
            .map(|shard| [0, 1].map(|index| (shard.task.into(), Some(shard.first_episode + index))))
            .concat()
    );
    for shard in in_order {
        let line = format!("log of {} {}\n", shard.task, shard.first_episode);
        assert!(log.contains(&line), "{log}");
    }

    assert!(
        !f.store
            .heartbeat(&running, 1, LEASE_S, f.now)
            .await
            .unwrap()
    );
    assert_eq!(
        f.commit_shard(&running, &running_shard).await,
        CommitOutcome::LeaseLost
    );
    assert!(
        f.claim().await.is_none(),
        "the remaining shards are dropped"
    );
    assert!(f.board().await.is_empty());
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, evaluation.id, f.now)
        .await;
    assert!(
        matches!(rerun, Err(StoreError::Conflict(_))),
        "agent faults count"
    );
}

#[tokio::test]
async fn shard_stopped_by_faults_ends_the_evaluation() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let strict = RunPlan {
        max_faults: 0,
        ..six_shard_plan()
    };
    let evaluation = f.evaluate(submission.id, &strict).await;
    let (claim, _, shard) = f.claim_shard().await;
    let mut stopped = shard_commit(&shard, 1);
    stopped.outcomes.truncate(1);
    stopped.stopped_by_faults = true;
    assert_eq!(
        f.store.commit_shard(&claim, stopped, f.now).await.unwrap(),
        CommitOutcome::Stored
    );
    assert!(matches!(
        f.state(evaluation.id).await,
        EvaluationState::AgentFailed { .. }
    ));
    let faults = f.store.run_faults(evaluation.run).await.unwrap().faults;
    assert_eq!(faults.len(), 1);
}
