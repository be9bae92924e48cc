//! Agents whose runtime no stage accepts are refused before they run.

use super::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

async fn wait_for_verdict(server: &Server, id: SubmissionId) -> Submission {
    let mut events = server.store.events();
    loop {
        let submission = server.store.submission(id).await.unwrap();
        if submission.state.is_checked() {
            return submission;
        }
        // After a lag, the state is read again.
        let _ = events.recv().await;
    }
}

#[tokio::test]
async fn unaccepted_runtime_is_refused_before_the_agent_runs() {
    let server = Server::new().await;
    let plan = RunPlan {
        profile: Profile::Ideal,
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        episodes_per_shard: 1,
        max_faults: 0,
        variation: Default::default(),
        limits: Default::default(),
    };
    let stage = configure_stage(&server.store, &plan, None, server.now()).await;
    let set_runtimes = async |runtimes: Option<&str>| {
        let rules = StageRules {
            runtimes: runtimes.map(|name| [name.to_owned()].into_iter().collect()),
            ..server.store.stage(stage).await.unwrap().rules.rules
        };
        let change = StageChange {
            rules: Some(rules),
            ..StageChange::default()
        };
        let changed = server
            .store
            .change_stage(Actor::Organiser, stage, change, server.now());
        changed.await.unwrap();
    };
    set_runtimes(Some("python3")).await;
    let evaluator = Scripted::new(|_, _| Ok(()));
    let running = server.start_slots(1, &evaluator);
    let refused = server.upload("Alpha", VALID_ARCHIVE).await;
    let refused = wait_for_verdict(&server, refused.id).await;
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

    for (team, runtimes) in [("Beta", Some("native")), ("Gamma", None)] {
        set_runtimes(runtimes).await;
        let valid = server.upload(team, VALID_ARCHIVE).await;
        let valid = wait_for_verdict(&server, valid.id).await;
        assert_eq!(valid.state, SubmissionState::Valid);
        assert_eq!(valid.runtime.as_deref(), Some("native"));
    }
    running.stop().await;
}
