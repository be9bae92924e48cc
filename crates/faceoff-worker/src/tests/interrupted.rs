//! Shutdowns, lost leases, cancelled evaluations and successors.

use super::{
    between::{Between, Moment},
    fixture::*,
};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use faceoff_types::Task;
use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shutdown_gives_the_unit_back_and_the_next_worker_finishes() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let hanging = Scripted::new(move |_, observer| {
        begun.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        Err(PlatformFault::Cancelled)
    });
    let running = server.work(2, &hanging);
    begins.recv().await.unwrap();
    begins.recv().await.unwrap();
    running.stop().await;
    assert!(hanging.played.lock().unwrap().is_empty());

    let healthy = Scripted::new(|_, _| Ok(()));
    let running = server.work(1, &healthy);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(healthy.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shutdown_does_not_stop_a_slot_before_its_unit_was_given_back() {
    let server = Server::new().await;
    server.evaluation().await;
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let (stopped, stops) = std::sync::mpsc::channel();
    let hanging = Scripted::new(move |_, observer| {
        begun.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        Err(PlatformFault::Cancelled)
    });
    let (early, stops) = (Arc::new(AtomicBool::new(false)), Mutex::new(stops));
    let running = server.work_through(1, &hanging, |local| {
        let early = Arc::clone(&early);
        Between::slots_and(local, move |moment| {
            if let Moment::GivingBack = moment {
                // Time for a worker that does not wait to end; one that waits is not in a hurry.
                let ended = stops
                    .lock()
                    .unwrap()
                    .recv_timeout(Duration::from_millis(200));
                early.store(ended.is_ok(), Ordering::SeqCst);
            }
            Ok(())
        })
    });
    begins.recv().await.unwrap();
    running.stop().await;
    let _ = stopped.send(());
    assert!(!early.load(Ordering::SeqCst));
    let work = server.store.claim("next", LEASE_S, server.now()).await;
    let Some(Work::Shard { shard, .. }) = work.unwrap().map(|claimed| claimed.work) else {
        panic!("the slot has left its shard to its lease")
    };
    assert_eq!((shard.task, shard.first_episode), (Task::Hit, 0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shutdown_ends_an_archive_that_is_being_unpacked() {
    let server = Server::new().await;
    let submission = server.upload("Alpha", b"endless").await;
    let evaluator = Scripted::new(|_, _| Ok(()));
    let running = server.work(1, &evaluator);
    evaluator.endless.notified().await;
    running.stop().await;
    // Given back at once, and nobody's fault.
    let work = server.store.claim("next", LEASE_S, server.now()).await;
    let Some(Work::Smoke {
        submission: next, ..
    }) = work.unwrap().map(|claimed| claimed.work)
    else {
        panic!("the slot has left its unit to its lease")
    };
    assert_eq!(next.id, submission.id);
    assert_eq!(next.state, SubmissionState::Validating);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancelled_evaluation_stops_its_slots() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let (stopped, mut stops) = tokio::sync::mpsc::unbounded_channel();
    let hanging = Scripted::new(move |spec, observer| {
        // progress makes the next look at the lease a matter of a second
        observer.episode_done(&outcome(spec.task, spec.episodes.start));
        begun.send(()).unwrap();
        while !observer.cancelled() {
            std::thread::yield_now();
        }
        stopped.send(()).unwrap();
        Err(PlatformFault::Cancelled)
    });
    let running = server.work(1, &hanging);
    begins.recv().await.unwrap();
    server
        .store
        .cancel_evaluation(Actor::Organiser, id, "rain", server.now())
        .await
        .unwrap();
    stops.recv().await.unwrap();
    running.stop().await;
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Cancelled { .. }
    ));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_played_under_a_lost_lease_is_thrown_away() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (handle, clock) = (tokio::runtime::Handle::current(), server.clock());
    let (store, ahead_s) = (server.store.clone(), Arc::clone(&server.ahead_s));
    let stolen = Arc::new(Mutex::new(None));
    let thief = Arc::clone(&stolen);
    let evaluator = Scripted::new(move |spec, _| {
        if thief.lock().unwrap().is_none() {
            // the slot stalls until its lease is over, and another worker takes and plays the shard
            ahead_s.fetch_add(i64::from(LEASE_S) + 1, Ordering::SeqCst);
            let work = handle
                .block_on(store.claim("thief", LEASE_S, clock.now()))
                .unwrap();
            let Some(Claimed {
                claim,
                work: Work::Shard { shard, .. },
            }) = work
            else {
                panic!("{work:?}")
            };
            assert_eq!(
                (shard.task, shard.first_episode),
                (spec.task, spec.episodes.start)
            );
            *thief.lock().unwrap() = Some(claim);
        }
        Ok(())
    });
    let running = server.work(1, &evaluator);
    let mut events = server.store.events();
    while evaluator.played.lock().unwrap().len() < 6 {
        let _ = events.recv().await;
    }
    let claim = stolen.lock().unwrap().clone().unwrap();
    let scratch = tempfile::tempdir().unwrap();
    std::fs::write(scratch.path().join("steps.parquet"), "by the thief").unwrap();
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
    let of_the_shard = std::fs::read_dir(recordings.join(claim.unit.to_string())).unwrap();
    assert_eq!(
        of_the_shard.count(),
        1,
        "the stalled slot has removed its own"
    );
    let shard = server.store.shards(run).await.unwrap().remove(0);
    let outcomes = (0..2).map(|episode| outcome(shard.task, episode)).collect();
    let commit = ShardCommit {
        outcomes,
        log: String::new(),
        stopped_by_faults: false,
        recording: Some(recording),
    };
    let committed = server
        .store
        .commit_shard(&claim, commit, server.now())
        .await
        .unwrap();
    assert_eq!(committed, Committed::Now);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(evaluator.assembled.lock().unwrap()[0], "by the thief");
    running.stop().await;
    server
        .store
        .remove_old_recordings(server.now() + RECORDINGS_KEPT)
        .await
        .unwrap();
    assert!(!recordings.exists() || std::fs::read_dir(&recordings).unwrap().next().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_new_life_takes_over_what_the_last_one_held() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    // a life that ended without a word: its scratch folder tells who it was
    let scratch = crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let worker = format!("{}/slot-0", scratch.worker());
    server
        .store
        .claim(&worker, 100_000, server.now())
        .await
        .unwrap()
        .unwrap();
    drop(scratch);
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    running.stop().await;
}

#[tokio::test]
async fn two_processes_cannot_share_a_scratch_folder() {
    let server = Server::new().await;
    let _other = crate::scratch::Scratch::take(&server.folder.path().join("scratch")).unwrap();
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    let error = running.task.await.unwrap().unwrap_err();
    assert!(error.to_string().contains("another process"), "{error}");
}
