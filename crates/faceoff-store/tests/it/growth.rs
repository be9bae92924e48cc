//! The database's write-ahead log stays bounded while it is read.

use crate::fixture::*;
use faceoff_store::*;
use sqlx::{Executor, SqliteConnection};
use std::{fs, path::PathBuf, sync::Arc};
use tokio::{sync::Semaphore, task::JoinSet};

/// Generous bound of what one transaction may add to a log that is being emptied.
const SLACK_BYTES: u64 = 4 << 20;

fn log_file(f: &TestStore) -> PathBuf {
    f.folder.path().join("faceoff.sqlite3-wal")
}

fn log_bytes(f: &TestStore) -> u64 {
    fs::metadata(log_file(f)).map_or(0, |found| found.len())
}

/// Writes half a megabyte, different each time, since SQLite does not write unchanged pages.
async fn write(f: &TestStore, run: faceoff_types::RunId, number: u8) {
    let text = char::from(b'a' + number % 26).to_string();
    let summary = format!("\"{}\"", text.repeat(512 << 10));
    f.store
        .store_episode_summary(run, 1, &summary, f.now)
        .await
        .unwrap();
}

/// A run to store summaries for.
async fn run(f: &TestStore) -> faceoff_types::RunId {
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await.run
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn log_stays_bounded_under_constant_reads() {
    let f = TestStore::new().await;
    let run = run(&f).await;
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
    let mut longest = 0;
    // five times the bound
    for number in 0..160 {
        // there are reads between any two writes
        reads.acquire_many(4).await.unwrap().forget();
        write(&f, run, number).await;
        longest = longest.max(log_bytes(&f));
    }
    readers.shutdown().await;
    assert!(longest > 0, "something was written");
    assert!(
        longest <= MAX_LOG_BYTES + SLACK_BYTES,
        "{longest} bytes of log"
    );
}

/// A read transaction as of another process.
async fn long_reader(f: &TestStore) -> SqliteConnection {
    let mut reader = f.connection().await;
    reader.execute("BEGIN").await.unwrap();
    reader.execute("SELECT COUNT(*) FROM events").await.unwrap();
    reader
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn log_is_emptied_after_a_long_read_transaction() {
    let f = TestStore::new().await;
    let run = run(&f).await;
    let mut other = long_reader(&f).await;
    let mut written = 0;
    while log_bytes(&f) <= MAX_LOG_BYTES {
        write(&f, run, written).await;
        written += 1;
        assert!(written < 200, "the reader should hold the log");
    }
    f.store.checkpoint().await.unwrap();
    assert!(
        log_bytes(&f) > MAX_LOG_BYTES,
        "the log is in use, and the checkpoint does not wait for it"
    );
    // the reader ends its transaction
    other.execute("COMMIT").await.unwrap();
    // a checkpoint that the last write started may still be running
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
    // more than the pool has connections
    for _ in 0..32 {
        downloads.push(f.store.artifacts().read("datasets/a").await.unwrap());
    }
    let run = run(&f).await;
    for number in 0..64 {
        write(&f, run, number).await;
    }
    f.store.season().await.unwrap();
    assert!(log_bytes(&f) <= MAX_LOG_BYTES + SLACK_BYTES);
    drop(downloads);
}
