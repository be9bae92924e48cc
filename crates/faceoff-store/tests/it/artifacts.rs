//! Tests of artifact storage: files (bundles, datasets) and folders (recordings) in the data folder, each under a key.

use crate::fixture::*;
use faceoff_store::*;
use futures::TryStreamExt;
use std::fs;

#[tokio::test]
async fn artifact_round_trip_is_exact() {
    let f = TestStore::new().await;
    let artifacts = f.store.artifacts();
    let scratch = tempfile::tempdir().unwrap();
    let (source, target) = (scratch.path().join("a"), scratch.path().join("b"));
    // Empty, small, and several chunks of which the last is incomplete.
    for bytes in [0, 1, (3 << 20) + 17] {
        // Bytes that do not repeat with a chunk's length.
        let content: Vec<u8> = (0..bytes).map(|i: usize| (i * 31 % 251) as u8).collect();
        fs::write(&source, &content).unwrap();
        artifacts.put_file("bundles/x.zip", &source).await.unwrap();
        artifacts
            .get_to_file("bundles/x.zip", &target)
            .await
            .unwrap();
        assert!(fs::read(&target).unwrap() == content, "{bytes} bytes");
        let (length, stream) = artifacts.read("bundles/x.zip").await.unwrap();
        let read: Vec<_> = stream.try_collect().await.unwrap();
        assert_eq!(length, bytes as u64);
        assert!(read.concat() == content);
    }
}

#[tokio::test]
async fn missing_artifact_is_not_found_but_deletable() {
    let f = TestStore::new().await;
    let artifacts = f.store.artifacts();
    let read = artifacts.read("datasets/none.zip").await;
    assert!(matches!(read.err(), Some(StoreError::NotFound("artifact"))));
    let folder = artifacts
        .get_folder("recordings/none", f.folder.path())
        .await;
    assert!(matches!(folder, Err(StoreError::NotFound("artifact"))));
    artifacts.delete("datasets/none.zip").await.unwrap();
    artifacts.delete_folder("recordings/none").await.unwrap();
}

#[tokio::test]
async fn artifact_keys_cannot_leave_the_folder() {
    let f = TestStore::new().await;
    let database = f.folder.path().join("faceoff.sqlite3");
    for key in [
        "../faceoff.sqlite3",
        "a/../../faceoff.sqlite3",
        "a//b",
        "",
        "./x",
    ] {
        assert!(
            f.store.artifacts().read(key).await.is_err(),
            "{key:?} was read"
        );
        assert!(
            f.store.artifacts().put_file(key, &database).await.is_err(),
            "{key:?} was written"
        );
    }
}

#[tokio::test]
async fn artifact_folders_are_complete_and_separate() {
    let f = TestStore::new().await;
    let artifacts = f.store.artifacts();
    let scratch = tempfile::tempdir().unwrap();
    let (from, to) = (scratch.path().join("from"), scratch.path().join("to"));
    fs::create_dir_all(&from).unwrap();
    fs::create_dir_all(&to).unwrap();
    fs::write(from.join("steps.parquet"), "steps").unwrap();
    fs::write(from.join("agent.log"), "log").unwrap();
    artifacts.put_folder("recordings/e/1", &from).await.unwrap();
    artifacts
        .put_folder("recordings/e/10", &from)
        .await
        .unwrap();
    artifacts.get_folder("recordings/e/1", &to).await.unwrap();
    assert_eq!(
        fs::read_to_string(to.join("steps.parquet")).unwrap(),
        "steps"
    );
    assert_eq!(fs::read_dir(&to).unwrap().count(), 2);
    artifacts.delete_folder("recordings/e/1").await.unwrap();
    assert!(artifacts.get_folder("recordings/e/1", &to).await.is_err());
    artifacts.get_folder("recordings/e/10", &to).await.unwrap();
}

#[tokio::test]
async fn recordings_are_deleted_a_day_after_the_evaluation() {
    let mut f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    let scratch = tempfile::tempdir().unwrap();
    fs::write(scratch.path().join("steps.parquet"), "steps").unwrap();
    let key = claim.recording_key(evaluation.run);
    f.store
        .artifacts()
        .put_folder(&key, scratch.path())
        .await
        .unwrap();
    f.commit_shard(&claim, &shard).await;
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 0);
    f.store
        .artifacts()
        .get_folder(&key, scratch.path())
        .await
        .unwrap();
    f.store
        .cancel_evaluation(Actor::Operator, evaluation.id, "rain", f.now)
        .await
        .unwrap();
    // A backup that started before the evaluation ended may still read the recordings.
    f.advance_clock_s(RECORDINGS_KEPT_FOR.as_secs() - 1);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 0);
    f.advance_clock_s(1);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 1);
    assert!(
        f.store
            .artifacts()
            .get_folder(&key, scratch.path())
            .await
            .is_err()
    );
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 0);
}

#[tokio::test]
async fn partial_artifacts_are_removed_and_others_kept() {
    let f = TestStore::new().await;
    let artifacts = f.store.artifacts();
    let bundles = f.folder.path().join("artifacts/bundles");
    let source = f.folder.path().join("source");
    fs::write(&source, "complete").unwrap();
    artifacts.put_file("bundles/1", &source).await.unwrap();
    // The temporary file of an interrupted write of `bundles/2`.
    fs::write(bundles.join("2#1"), "comp").unwrap();
    let now = jiff::Timestamp::now();
    let hour = jiff::SignedDuration::from_hours(1);
    assert_eq!(
        artifacts.remove_abandoned(now - hour).await.unwrap(),
        0,
        "a write may still be in progress"
    );
    assert_eq!(artifacts.remove_abandoned(now + hour).await.unwrap(), 1);
    assert!(!bundles.join("2#1").exists());
    assert!(artifacts.read("bundles/1").await.is_ok());
    assert!(
        artifacts.put_file("bundles/3#1", &source).await.is_err(),
        "a key cannot look like a temporary file"
    );
}

#[tokio::test]
async fn delete_others_keeps_one_artifact_of_a_prefix() {
    let f = TestStore::new().await;
    let artifacts = f.store.artifacts();
    let source = f.folder.path().join("source");
    fs::write(&source, "x").unwrap();
    for key in ["datasets/e/1.zip", "datasets/e/2.zip", "datasets/f/1.zip"] {
        artifacts.put_file(key, &source).await.unwrap();
    }
    artifacts
        .delete_others("datasets/e", "datasets/e/2.zip")
        .await
        .unwrap();
    assert!(artifacts.read("datasets/e/1.zip").await.is_err());
    assert!(artifacts.read("datasets/e/2.zip").await.is_ok());
    assert!(artifacts.read("datasets/f/1.zip").await.is_ok());
}
