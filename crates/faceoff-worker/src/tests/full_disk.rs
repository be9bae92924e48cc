//! Full disks, at moments that a disk cannot be made to choose.

use super::{
    between::{Between, Moment},
    fixture::*,
};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

fn full() -> anyhow::Error {
    StoreError::FullDisk("the queue".into()).into()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_interrupts_a_shard_as_often_as_it_likes_and_costs_no_try() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (calls, ahead_s) = (AtomicU32::new(0), Arc::clone(&server.ahead_s));
    let evaluator = Scripted::new(move |spec, _| {
        assert_eq!(spec.platform_retries, 0, "no try was lost");
        // the rest after each passes
        ahead_s.fetch_add(10, Ordering::SeqCst);
        if calls.fetch_add(1, Ordering::SeqCst) < 3 * MAX_ATTEMPTS {
            return Err(PlatformFault::FullDisk("steps.parquet".into()));
        }
        Ok(())
    });
    let running = server.work(1, &evaluator);
    let state = server.over(id).await;
    assert!(
        matches!(state, EvaluationState::Finished { .. }),
        "{state:?}"
    );
    assert_eq!(evaluator.played.lock().unwrap().len(), 6);
    running.stop().await;
    let events = server.store.events_after(0, 1000).await.unwrap();
    let blames = |record: &EventRecord| matches!(record.event, Event::UnitGivenBack { .. });
    assert!(!events.iter().any(blames), "{events:#?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_played_is_committed_when_there_is_room_and_not_played_again() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let evaluator = Scripted::new(|_, _| Ok(()));
    let failures = AtomicU32::new(0);
    let running = server.work_through(1, &evaluator, |local| {
        Between::slots_and(local, move |moment| match moment {
            // every report, whether it was stored or not
            Moment::Committed(_) if failures.fetch_add(1, Ordering::SeqCst) % 4 < 3 => Err(full()),
            _ => Ok(()),
        })
    });
    let state = server.over(id).await;
    assert!(
        matches!(state, EvaluationState::Finished { .. }),
        "{state:?}"
    );
    running.stop().await;
    assert_eq!(evaluator.played.lock().unwrap().len(), 6, "each shard once");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_unit_is_given_back_when_there_is_room_to_say_so() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (calls, ahead_s) = (AtomicU32::new(0), Arc::clone(&server.ahead_s));
    let evaluator = Scripted::new(move |spec, _| {
        ahead_s.fetch_add(10, Ordering::SeqCst);
        assert_eq!(spec.platform_retries, 0, "its lease did not end");
        match calls.fetch_add(1, Ordering::SeqCst) {
            0 => Err(PlatformFault::FullDisk("steps.parquet".into())),
            _ => Ok(()),
        }
    });
    let refusals = AtomicU32::new(0);
    let running = server.work_through(1, &evaluator, |local| {
        Between::slots_and(local, move |moment| match moment {
            Moment::GivingBack if refusals.fetch_add(1, Ordering::SeqCst) < 5 => Err(full()),
            _ => Ok(()),
        })
    });
    let state = server.over(id).await;
    assert!(
        matches!(state, EvaluationState::Finished { .. }),
        "{state:?}"
    );
    running.stop().await;
}
