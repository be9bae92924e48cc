//! The database's log stays short, whoever reads.

use crate::fixture::*;
use faceoff_store::*;
use sqlx::{Executor, SqliteConnection};
use std::{fs, path::PathBuf, sync::Arc};
use tokio::{sync::Semaphore, task::JoinSet};

/// What one transaction may add to a log that is being emptied, generously.
const SLACK_BYTES: u64 = 4 << 20;

fn log_file(f: &Fixture) -> PathBuf {
    f.folder.path().join("faceoff.sqlite3-wal")
}

fn log_bytes(f: &Fixture) -> u64 {
    fs::metadata(log_file(f)).map_or(0, |found| found.len())
}

/// Writes half a megabyte: another one each time, since SQLite does not write what is there already.
async fn write(f: &Fixture, run: faceoff_types::RunId, number: u8) {
    let text = char::from(b'a' + number % 26).to_string();
    let summary = format!("\"{}\"", text.repeat(512 << 10));
    f.store
        .keep_episode_summary(run, 1, &summary, f.now)
        .await
        .unwrap();
}

/// A run that something can be written of.
async fn run(f: &Fixture) -> faceoff_types::RunId {
    let submission = f.ready_team("Alpha").await;
    f.evaluate(submission.id, &plan()).await.run
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn readers_that_never_pause_do_not_let_the_log_grow() {
    let f = Fixture::new().await;
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
        // between two writes there are always readers
        reads.acquire_many(4).await.unwrap().forget();
        write(&f, run, number).await;
        longest = longest.max(log_bytes(&f));
    }
    readers.shutdown().await;
    assert!(longest > 0, "something was written");
    assert!(
        longest <= LOG_BOUND_BYTES + SLACK_BYTES,
        "{longest} bytes of log"
    );
}

/// A read transaction as of another process.
async fn long_reader(f: &Fixture) -> SqliteConnection {
    let mut reader = f.connection().await;
    reader.execute("BEGIN").await.unwrap();
    reader.execute("SELECT COUNT(*) FROM events").await.unwrap();
    reader
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_log_that_another_process_has_held_is_emptied_when_it_lets_go() {
    let f = Fixture::new().await;
    let run = run(&f).await;
    let mut other = long_reader(&f).await;
    let mut written = 0;
    while log_bytes(&f) <= LOG_BOUND_BYTES {
        write(&f, run, written).await;
        written += 1;
        assert!(written < 200, "the reader should hold the log");
    }
    f.store.checkpoint().await.unwrap();
    assert!(
        log_bytes(&f) > LOG_BOUND_BYTES,
        "it is held, and nobody waits for long"
    );
    // the reader's state is as it was
    other.execute("COMMIT").await.unwrap();
    // one that was begun by the last write may be under way still
    while log_bytes(&f) > LOG_BOUND_BYTES {
        f.store.checkpoint().await.unwrap();
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn what_is_streamed_holds_no_reader() {
    let f = Fixture::new().await;
    let file = f.folder.path().join("dataset");
    fs::write(&file, vec![7; 1 << 20]).unwrap();
    f.store
        .artifacts()
        .put_file("datasets/a", &file)
        .await
        .unwrap();
    let mut downloads = Vec::new();
    // more than there are connections
    for _ in 0..32 {
        downloads.push(f.store.artifacts().read("datasets/a").await.unwrap());
    }
    let run = run(&f).await;
    for number in 0..64 {
        write(&f, run, number).await;
    }
    f.store.season().await.unwrap();
    assert!(log_bytes(&f) <= LOG_BOUND_BYTES + SLACK_BYTES);
    drop(downloads);
}
