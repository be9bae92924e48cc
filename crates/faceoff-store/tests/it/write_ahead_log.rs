//! The size of the database's write-ahead log (the file to which SQLite appends changes until a checkpoint copies them into the
//! database) stays bounded while the database is read.

use crate::fixture::*;
use faceoff_store::*;
use sqlx::{Executor, SqliteConnection};
use std::{fs, path::PathBuf, sync::Arc};
use tokio::{sync::Semaphore, task::JoinSet};

/// More than one transaction adds to the log while a checkpoint empties it.
const SLACK_BYTES: u64 = 4 << 20;

fn log_file(f: &TestStore) -> PathBuf {
    f.folder.path().join("faceoff.sqlite3-wal")
}

fn log_bytes(f: &TestStore) -> u64 {
    fs::metadata(log_file(f)).map_or(0, |metadata| metadata.len())
}

/// Stores a summary of half a megabyte, different for each `number`, since SQLite does not write unchanged pages.
async fn write_summary(f: &TestStore, run: faceoff_types::RunId, number: u8) {
    let text = char::from(b'a' + number % 26).to_string();
    let summary = format!("\"{}\"", text.repeat(512 << 10));
    f.store
        .store_episode_summary(run, 1, &summary, f.now)
        .await
        .unwrap();
}

/// Creates a run, for which summaries can be stored.
async fn create_run(f: &TestStore) -> faceoff_types::RunId {
    f.start_evaluation(&six_shard_plan()).await.run
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn log_stays_bounded_under_constant_reads() {
    let f = TestStore::new().await;
    let run = create_run(&f).await;
    let today = f.now.to_zoned(jiff::tz::TimeZone::UTC).date();
    let mut readers = JoinSet::new();
    let reads = Arc::new(Semaphore::new(0));
    for _ in 0..8 {
        let (store, reads) = (f.store.clone(), Arc::clone(&reads));
        readers.spawn(async move {
            loop {
                store.evaluations_on(today).await.unwrap();
                store.episode_summaries(&[run], 1).await.unwrap();
                reads.add_permits(1);
            }
        });
    }
    let mut max_bytes = 0;
    // All writes together are five times the bound.
    for number in 0..160 {
        // Some of the readers' reads end between any two writes.
        reads.acquire_many(4).await.unwrap().forget();
        write_summary(&f, run, number).await;
        max_bytes = max_bytes.max(log_bytes(&f));
    }
    readers.shutdown().await;
    assert!(max_bytes > 0, "something was written");
    assert!(
        max_bytes <= MAX_LOG_BYTES + SLACK_BYTES,
        "{max_bytes} bytes of log"
    );
}

/// A connection past the store, as of another process, with an open read transaction.
async fn open_reader(f: &TestStore) -> SqliteConnection {
    let mut reader = f.connection().await;
    reader.execute("BEGIN").await.unwrap();
    reader.execute("SELECT COUNT(*) FROM events").await.unwrap();
    reader
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn log_is_emptied_after_a_long_read_transaction() {
    let f = TestStore::new().await;
    let run = create_run(&f).await;
    let mut reader = open_reader(&f).await;
    let mut written = 0;
    while log_bytes(&f) <= MAX_LOG_BYTES {
        write_summary(&f, run, written).await;
        written += 1;
        assert!(
            written < 200,
            "the read transaction keeps the log from being emptied"
        );
    }
    f.store.checkpoint().await.unwrap();
    assert!(
        log_bytes(&f) > MAX_LOG_BYTES,
        "the log is in use, and the checkpoint does not wait for it"
    );
    reader.execute("COMMIT").await.unwrap();
    // A checkpoint that the last write started may still be running.
    while log_bytes(&f) > MAX_LOG_BYTES {
        f.store.checkpoint().await.unwrap();
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn artifact_streams_hold_no_read_connection() {
    let f = TestStore::new().await;
    let file = f.folder.path().join("dataset");
    fs::write(&file, vec![7; 1 << 20]).unwrap();
    f.store
        .artifacts()
        .put_file("datasets/a", &file)
        .await
        .unwrap();
    let mut downloads = Vec::new();
    // More downloads than the pool has connections.
    for _ in 0..32 {
        downloads.push(f.store.artifacts().read("datasets/a").await.unwrap());
    }
    let run = create_run(&f).await;
    for number in 0..64 {
        write_summary(&f, run, number).await;
    }
    f.store.season().await.unwrap();
    assert!(log_bytes(&f) <= MAX_LOG_BYTES + SLACK_BYTES);
    drop(downloads);
}
