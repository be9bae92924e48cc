//! Evaluations on a real server: their outcomes do not depend on shards, slots and restarts, and failures are reported.

use crate::server::Server;
use faceoff_airhockey::{DEFEND, TASKS};
use faceoff_store::*;
use faceoff_testkit::{configure_stage, six_shard_plan};
use faceoff_types::*;
use jiff::Timestamp;

/// A plan of two episodes of each task.
pub fn plan(episodes_per_shard: u32) -> RunPlan {
    RunPlan {
        tasks: TASKS.to_vec(),
        episodes_per_task: 2,
        episodes_per_shard,
        max_faults: 2,
        ..six_shard_plan()
    }
}

/// The outcomes without measured times, which must not depend on the distribution of jobs.
pub fn without_times(mut outcomes: Vec<EpisodeOutcome>) -> Vec<EpisodeOutcome> {
    for outcome in &mut outcomes {
        outcome.computation_time = ComputationTime::default();
    }
    outcomes
}

/// Plays a day with two teams and returns the outcomes of each.
async fn play_day(
    server: &Server,
    episodes_per_shard: u32,
    now: Timestamp,
) -> Vec<Vec<EpisodeOutcome>> {
    let evaluations = server.start_day(&plan(episodes_per_shard), now).await;
    assert_eq!(evaluations.len(), 2);
    let worker = server.start_worker(2);
    let mut outcomes = Vec::new();
    let stage = evaluations[0].stage_day.stage;
    for evaluation in evaluations {
        let state = server.wait_for_end(evaluation.id).await;
        let EvaluationState::Finished {
            result, dataset, ..
        } = state
        else {
            panic!("{state:?}")
        };
        assert_eq!(result.tasks.len(), 3);
        assert!(
            result
                .tasks
                .values()
                .all(|task| task.episodes == 2 && task.steps > 0)
        );
        let archive = server.path().join("dataset.zip");
        server
            .store
            .artifacts()
            .get_to_file(&dataset, &archive)
            .await
            .unwrap();
        assert!(std::fs::read(&archive).unwrap().starts_with(b"PK"));
        outcomes.push(without_times(
            server.store.outcomes(evaluation.run).await.unwrap(),
        ));
    }
    assert_eq!(server.store.board(stage, 1).await.unwrap().len(), 2);
    worker.stop().await;
    outcomes
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn outcomes_do_not_depend_on_shards_and_slots() {
    let server = Server::new().await;
    // The stage is configured before the copy, since seeds depend on the stage's id.
    configure_stage(&server.store, &plan(1), None, Timestamp::now()).await;
    let worker = server.start_worker(2);
    for team in ["Alpha", "Beta"] {
        let submission = server.upload(team, "").await;
        let state = server.wait_for_validation(submission).await;
        assert_eq!(state, SubmissionState::Valid);
        let log = server.store.submission_log(submission).await.unwrap();
        assert!(log.unwrap().contains("an agent's log"));
    }
    worker.stop().await;
    // Two servers with the same history.
    let copy = server.copy().await;
    let server = Server::at(server.path()).await;
    let now = Timestamp::now();
    let outcomes = play_day(&server, 1, now).await;
    assert_eq!(outcomes[0], outcomes[1]);
    assert_eq!(play_day(&copy, 2, now).await, outcomes);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn failing_agent_gets_reason_and_log() {
    let server = Server::new().await;
    let worker = server.start_worker(1);
    let invalid = server.upload("Broken", "GOOD_EPISODES = \"0\"").await;
    let state = server.wait_for_validation(invalid).await;
    let SubmissionState::Invalid { reason } = &state else {
        panic!("{state:?}")
    };
    assert!(reason.contains("exited with status 3"), "{reason}");
    let log = server.store.submission_log(invalid).await.unwrap();
    assert!(log.unwrap().contains("an agent's log"));

    // This agent exits after 15 episodes: after its validation run, which is shorter, and in each shard of 20 episodes. The
    // faults of all shards add up.
    let failing_later = server.upload("Late", "GOOD_EPISODES = \"15\"").await;
    assert!(matches!(
        server.wait_for_validation(failing_later).await,
        SubmissionState::Valid
    ));
    let plan = RunPlan {
        tasks: vec![DEFEND],
        episodes_per_task: 60,
        ..plan(20)
    };
    let evaluation = server.start_day(&plan, Timestamp::now()).await.remove(0);
    assert_eq!(evaluation.submission, failing_later);
    let state = server.wait_for_end(evaluation.id).await;
    assert!(
        matches!(state, EvaluationState::AgentFailed { .. }),
        "{state:?}"
    );
    let RunFaults { faults, log } = server.store.run_faults(evaluation.run).await.unwrap();
    let episodes: Vec<Option<u32>> = faults.iter().map(|fault| fault.episode).collect();
    assert_eq!(episodes, [Some(15), Some(35), Some(55)]);
    assert!(log.contains("an agent's log"), "{log}");
    worker.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn evaluation_continues_after_worker_restarts() {
    let server = Server::new().await;
    let worker = server.start_worker(1);
    let submission = server.upload("Alpha", "").await;
    assert!(matches!(
        server.wait_for_validation(submission).await,
        SubmissionState::Valid
    ));
    worker.stop().await;
    let evaluation = server.start_day(&plan(1), Timestamp::now()).await.remove(0);
    let (id, run) = (evaluation.id, evaluation.run);
    for committed_episodes in 1..4 {
        let worker = server.start_worker(1);
        let mut events = server.store.events();
        while server.store.outcomes(run).await.unwrap().len() < committed_episodes {
            let _ = events.recv().await;
        }
        // Stops in the middle of the next shard.
        worker.stop().await;
    }
    let worker = server.start_worker(1);
    let state = server.wait_for_end(id).await;
    assert!(
        matches!(state, EvaluationState::Finished { .. }),
        "{state:?}"
    );
    // Two episodes of each of three tasks.
    assert_eq!(server.store.outcomes(run).await.unwrap().len(), 6);
    worker.stop().await;
}
