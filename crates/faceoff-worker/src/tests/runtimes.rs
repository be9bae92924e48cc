//! Agents whose runtime no stage accepts are refused before they run.

use super::fixture::*;
use faceoff_airhockey::IDEAL;
use faceoff_store::*;
use faceoff_testkit::{accept_runtimes, configure_stage, one_shard_plan, wait_for_validation};

#[tokio::test]
async fn unaccepted_runtime_is_refused_before_the_agent_runs() {
    let server = Server::new().await;
    let plan = RunPlan {
        profile: IDEAL,
        max_faults: 0,
        ..one_shard_plan()
    };
    let stage = configure_stage(&server.store, &plan, None, server.now()).await;
    let set_runtimes = async |runtimes| {
        accept_runtimes(&server.store, stage, runtimes, server.now()).await;
    };
    set_runtimes(Some(&["python3"])).await;
    let evaluator = ScriptedEvaluator::new(|_, _| Ok(()));
    let running = server.start_slots(1, &evaluator);
    let refused = server.upload("Alpha", VALID_ARCHIVE).await;
    let refused = wait_for_validation(&server.store, refused.id).await;
    let SubmissionState::Invalid { reason } = &refused.state else {
        panic!("expected a refusal, got {refused:?}");
    };
    for words in ["python3 only", "names native in agent.toml", "“Qualifying”"] {
        assert!(reason.contains(words), "{reason}");
    }
    assert_eq!(
        (refused.runtime.as_deref(), refused.agent_name.as_deref()),
        (Some("native"), Some("scripted"))
    );
    let log = server.store.submission_log(refused.id).await.unwrap();
    assert_eq!(log.as_deref(), Some(""), "it did not run");

    for (team, runtimes) in [("Beta", Some(&["native"][..])), ("Gamma", None)] {
        set_runtimes(runtimes).await;
        let valid = server.upload(team, VALID_ARCHIVE).await;
        let valid = wait_for_validation(&server.store, valid.id).await;
        assert_eq!(valid.state, SubmissionState::Valid);
        assert_eq!(valid.runtime.as_deref(), Some("native"));
    }
    running.stop().await;
}
