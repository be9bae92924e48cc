//! Full disks at exact moments, which a real full disk cannot be made to hit.

use super::{
    fixture::*,
    intercepted_server::{InterceptedServer, Interception},
};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

fn full_disk_error() -> anyhow::Error {
    StoreError::DiskFull("the queue".into()).into()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn full_disk_does_not_count_as_an_attempt() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (calls, clock_ahead_s) = (AtomicU32::new(0), Arc::clone(&server.clock_ahead_s));
    let evaluator = ScriptedEvaluator::new(move |spec, _| {
        assert_eq!(spec.platform_retries, 0, "no attempt was counted");
        // Skips the pause after each failure.
        clock_ahead_s.fetch_add(10, Ordering::SeqCst);
        if calls.fetch_add(1, Ordering::SeqCst) < 3 * MAX_PLATFORM_FAULTS {
            return Err(PlatformFault::FullDisk("steps.parquet".into()));
        }
        Ok(())
    });
    let running = server.start_slots(1, &evaluator);
    server.wait_for_result(id).await;
    assert_eq!(evaluator.played.lock().unwrap().len(), 6);
    running.stop().await;
    let events = server.store.events_after(0, 1000).await.unwrap();
    let is_counted = |record: &EventRecord| matches!(record.event, Event::JobFailed { .. });
    assert!(!events.iter().any(is_counted), "{events:#?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn commit_waits_for_disk_space_without_running_the_job_again() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let evaluator = ScriptedEvaluator::new(|_, _| Ok(()));
    let failures = AtomicU32::new(0);
    let running = server.start_intercepted_slots(1, &evaluator, |local| {
        InterceptedServer::wrap(local, move |interception| match interception {
            // Three of four calls return an error, although the report was stored.
            Interception::Committed(_) if failures.fetch_add(1, Ordering::SeqCst) % 4 < 3 => {
                Err(full_disk_error())
            }
            _ => Ok(()),
        })
    });
    server.wait_for_result(id).await;
    running.stop().await;
    assert_eq!(evaluator.played.lock().unwrap().len(), 6, "each shard once");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn release_waits_for_disk_space() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (calls, clock_ahead_s) = (AtomicU32::new(0), Arc::clone(&server.clock_ahead_s));
    let evaluator = ScriptedEvaluator::new(move |spec, _| {
        clock_ahead_s.fetch_add(10, Ordering::SeqCst);
        assert_eq!(spec.platform_retries, 0, "the lease did not expire");
        match calls.fetch_add(1, Ordering::SeqCst) {
            0 => Err(PlatformFault::FullDisk("steps.parquet".into())),
            _ => Ok(()),
        }
    });
    let refusals = AtomicU32::new(0);
    let running = server.start_intercepted_slots(1, &evaluator, |local| {
        InterceptedServer::wrap(local, move |interception| match interception {
            Interception::Releasing if refusals.fetch_add(1, Ordering::SeqCst) < 5 => {
                Err(full_disk_error())
            }
            _ => Ok(()),
        })
    });
    server.wait_for_result(id).await;
    running.stop().await;
}
