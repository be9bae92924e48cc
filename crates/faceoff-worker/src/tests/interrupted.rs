//! Shutdowns, lost leases, cancelled evaluations and restarts.

use super::{
    fixture::*,
    intercepted_server::{InterceptedServer, Interception},
};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use faceoff_testkit::shard_commit;
use faceoff_types::Task;
use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};
use tokio::sync::mpsc::UnboundedReceiver;

/// An evaluator whose shards run until they are cancelled; the channel reports their starts.
fn hanging_evaluator() -> (Arc<ScriptedEvaluator>, UnboundedReceiver<(Task, u32)>) {
    let (started, starts) = tokio::sync::mpsc::unbounded_channel();
    let hanging = ScriptedEvaluator::new(move |spec, observer| {
        started.send((spec.task, spec.episodes.start)).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        Err(PlatformFault::Cancelled)
    });
    (hanging, starts)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn shutdown_releases_jobs_for_the_next_worker() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (hanging, mut starts) = hanging_evaluator();
    let running = server.start_slots(2, &hanging);
    starts.recv().await.unwrap();
    starts.recv().await.unwrap();
    running.stop().await;
    assert!(hanging.played.lock().unwrap().is_empty());

    let healthy = ScriptedEvaluator::new(|_, _| Ok(()));
    let running = server.start_slots(1, &healthy);
    server.wait_for_result(id).await;
    assert_eq!(healthy.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn shutdown_releases_job_before_the_slot_ends() {
    let server = Server::new().await;
    server.start_evaluation().await;
    let (hanging, mut starts) = hanging_evaluator();
    let (worker_ended, worker_end) = std::sync::mpsc::channel();
    // Did the worker end before it had released its job? The releasing call waits for the worker's end, in vain if all is right.
    let (ended_early, worker_end) = (Arc::new(AtomicBool::new(false)), Mutex::new(worker_end));
    let running = server.start_intercepted_slots(1, &hanging, |local| {
        let ended_early = Arc::clone(&ended_early);
        InterceptedServer::wrap(local, move |interception| {
            if let Interception::Releasing = interception {
                // Enough time for a worker that wrongly does not wait for the release.
                let ended = worker_end
                    .lock()
                    .unwrap()
                    .recv_timeout(Duration::from_millis(200));
                ended_early.store(ended.is_ok(), Ordering::SeqCst);
            }
            Ok(())
        })
    });
    let first = starts.recv().await;
    running.stop().await;
    let _ = worker_ended.send(());
    assert!(!ended_early.load(Ordering::SeqCst));
    let claimed = server.store.claim("next", LEASE_S, server.now()).await;
    let Some(Job::Shard { shard, .. }) = claimed.unwrap().map(|claimed| claimed.job) else {
        panic!("the slot did not release its shard")
    };
    assert_eq!(Some((shard.task, shard.first_episode)), first);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn shutdown_interrupts_unpacking() {
    let server = Server::new().await;
    let submission = server.upload("Alpha", ENDLESS_ARCHIVE).await;
    let evaluator = ScriptedEvaluator::new(|_, _| Ok(()));
    let running = server.start_slots(1, &evaluator);
    evaluator.endless_unpacking.notified().await;
    running.stop().await;
    // The job was released at once, without a fault.
    let claimed = server.store.claim("next", LEASE_S, server.now()).await;
    let Some(Job::Validation {
        submission: next, ..
    }) = claimed.unwrap().map(|claimed| claimed.job)
    else {
        panic!("the slot did not release its job")
    };
    assert_eq!(next.id, submission.id);
    assert_eq!(next.state, SubmissionState::Validating);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cancelled_evaluation_stops_its_slots() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (started, mut starts) = tokio::sync::mpsc::unbounded_channel();
    let (stopped, mut stops) = tokio::sync::mpsc::unbounded_channel();
    let hanging = ScriptedEvaluator::new(move |spec, observer| {
        // Progress triggers a renewal within a second.
        observer.on_episode_end(&outcome(spec.task, spec.episodes.start));
        started.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        stopped.send(()).unwrap();
        Err(PlatformFault::Cancelled)
    });
    let running = server.start_slots(1, &hanging);
    starts.recv().await.unwrap();
    server
        .store
        .cancel_evaluation(Actor::Operator, id, "rain", server.now())
        .await
        .unwrap();
    stops.recv().await.unwrap();
    running.stop().await;
    assert!(matches!(
        server.wait_for_end(id).await,
        EvaluationState::Cancelled { .. }
    ));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn result_of_a_lost_lease_is_discarded() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (handle, clock) = (tokio::runtime::Handle::current(), server.clock());
    let (store, clock_ahead_s) = (server.store.clone(), Arc::clone(&server.clock_ahead_s));
    let second_claim = Arc::new(Mutex::new(None));
    let claim_of_evaluator = Arc::clone(&second_claim);
    let evaluator = ScriptedEvaluator::new(move |spec, _| {
        if claim_of_evaluator.lock().unwrap().is_none() {
            // The slot stalls until its lease has expired, and another worker claims the shard.
            clock_ahead_s.fetch_add(i64::from(LEASE_S) + 1, Ordering::SeqCst);
            let claimed = handle
                .block_on(store.claim("second worker", LEASE_S, clock.now()))
                .unwrap();
            let Some(ClaimedJob {
                claim,
                job: Job::Shard { shard, .. },
            }) = claimed
            else {
                panic!("{claimed:?}")
            };
            assert_eq!(
                (shard.task, shard.first_episode),
                (spec.task, spec.episodes.start)
            );
            *claim_of_evaluator.lock().unwrap() = Some((claim, shard));
        }
        Ok(())
    });
    let running = server.start_slots(1, &evaluator);
    let mut events = server.store.events();
    while evaluator.played.lock().unwrap().len() < 6 {
        let _ = events.recv().await;
    }
    // The second worker commits its recording of the shard.
    let (claim, shard) = second_claim.lock().unwrap().clone().unwrap();
    let scratch = tempfile::tempdir().unwrap();
    std::fs::write(scratch.path().join("steps.parquet"), "by the second worker").unwrap();
    let run = server.store.evaluation(id).await.unwrap().run;
    let recording = claim.recording_key(run);
    server
        .store
        .artifacts()
        .put_folder(&recording, scratch.path())
        .await
        .unwrap();
    let recordings = server
        .folder
        .path()
        .join("artifacts/recordings")
        .join(run.to_string());
    let shard_recordings = std::fs::read_dir(recordings.join(claim.job.to_string())).unwrap();
    assert_eq!(
        shard_recordings.count(),
        1,
        "the stalled slot has removed its own recording"
    );
    let episodes = shard.first_episode..shard.end_episode;
    let outcomes = episodes
        .map(|episode| outcome(shard.task, episode))
        .collect();
    let commit = shard_commit(outcomes, Some(recording));
    let committed = server
        .store
        .commit_shard(&claim, commit, server.now())
        .await
        .unwrap();
    assert_eq!(committed, CommitOutcome::Stored);
    server.wait_for_result(id).await;
    let shards = server.store.shards(run).await.unwrap();
    let position = shards.iter().position(|other| other.id == shard.id);
    assert_eq!(
        evaluator.assembled.lock().unwrap()[position.unwrap()],
        "by the second worker"
    );
    running.stop().await;
    server
        .store
        .remove_old_recordings(server.now() + RECORDINGS_KEPT_FOR)
        .await
        .unwrap();
    assert!(!recordings.exists() || std::fs::read_dir(&recordings).unwrap().next().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn restarted_worker_releases_its_former_leases() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    // A process has ended without releasing its job. The scratch folder stores the worker's name.
    let scratch = crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let worker = format!("{}/slot-0", scratch.worker());
    server
        .store
        .claim(&worker, 100_000, server.now())
        .await
        .unwrap()
        .unwrap();
    drop(scratch);
    let running = server.start_slots(1, &ScriptedEvaluator::new(|_, _| Ok(())));
    server.wait_for_result(id).await;
    running.stop().await;
}

#[tokio::test]
async fn scratch_folder_cannot_be_shared() {
    let server = Server::new().await;
    let _first_process =
        crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let running = server.start_slots(1, &ScriptedEvaluator::new(|_, _| Ok(())));
    let error = running.task.await.unwrap().unwrap_err();
    assert!(error.to_string().contains("another process"), "{error}");
}
