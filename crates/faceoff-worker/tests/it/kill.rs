//! Repeated `kill -9` of a worker process, and the result of its evaluation.

use crate::{
    evaluations::{plan, without_times},
    killed_child::{run_and_kill, run_jobs},
    server::Server,
};
use faceoff_store::*;
use jiff::Timestamp;

/// Runs jobs until the process is killed or the evaluation is over, and prints a line for each event. Started by the
/// test below.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "the child process of killed_evaluation_has_the_same_result"]
async fn child_process_runs_evaluation() {
    run_jobs(1, async |server, id| {
        let id = id.parse().unwrap();
        server.store.evaluation(id).await.unwrap().state.is_over()
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn killed_evaluation_has_the_same_result() {
    let server = Server::new().await;
    let worker = server.start_worker(1);
    for team in ["Undisturbed", "Killed"] {
        let submission = server.upload(team, "").await;
        assert!(matches!(
            server.wait_for_validation(submission).await,
            SubmissionState::Valid
        ));
    }
    let started = server.start_day(&plan(1), Timestamp::now()).await;
    let [undisturbed, killed] = &started[..] else {
        panic!("two teams play: {started:?}")
    };
    let finished = server.wait_for_end(undisturbed.id).await;
    assert!(
        matches!(finished, EvaluationState::Finished { .. }),
        "{finished:?}"
    );
    // The other evaluation has hardly started.
    worker.stop().await;

    let id = killed.id.to_string();
    for events_to_live in [1, 2, 3, 1, 4, 2] {
        let seen_events = run_and_kill(
            &server,
            "kill::child_process_runs_evaluation",
            &id,
            events_to_live,
        );
        let over = server
            .store
            .evaluation(killed.id)
            .await
            .unwrap()
            .state
            .is_over();
        assert!(
            over || seen_events == events_to_live,
            "the child ended early"
        );
    }
    let worker = server.start_worker(1);
    let state = server.wait_for_end(killed.id).await;
    let EvaluationState::Finished { dataset, .. } = state else {
        panic!("{state:?}")
    };
    worker.stop().await;

    let undisturbed = without_times(server.store.outcomes(undisturbed.run).await.unwrap());
    let killed = without_times(server.store.outcomes(killed.run).await.unwrap());
    assert_eq!(killed, undisturbed);
    let published = server.path().join("data/artifacts").join(dataset);
    let kept = std::fs::read_dir(published.parent().unwrap()).unwrap();
    let mut kept: Vec<_> = kept.map(|entry| entry.unwrap().path()).collect();
    kept.sort();
    let clips = published.with_extension("zip.clips");
    assert_eq!(kept, [published, clips], "no unpublished dataset is left");
}
