//! Clearing of runs that ended long ago: a summary of the episodes is stored, and the rows of the run's shards (groups of
//! episodes that are run together), of their jobs and of their events are deleted.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{EpisodeOutcome, RunId};

/// Version of the summary's format.
const SUMMARY_VERSION: u32 = 7;

async fn clearable_runs(f: &TestStore) -> Vec<RunId> {
    f.store
        .clearable_runs(SUMMARY_VERSION, f.now)
        .await
        .unwrap()
}

async fn unsummarised_runs(f: &TestStore) -> Vec<RunId> {
    f.store.unsummarised_runs(SUMMARY_VERSION).await.unwrap()
}

async fn count_rows(f: &TestStore, table: &str) -> i64 {
    let sql = format!("SELECT COUNT(*) FROM {table}");
    sqlx::query_scalar(sqlx::AssertSqlSafe(sql))
        .fetch_one(&mut f.connection().await)
        .await
        .unwrap()
}

async fn event_kinds(f: &TestStore) -> Vec<String> {
    let sql = "SELECT kind FROM events ORDER BY id";
    let kinds = sqlx::query_scalar(sql);
    kinds.fetch_all(&mut f.connection().await).await.unwrap()
}

async fn outcomes(
    f: &TestStore,
    evaluation: &Evaluation,
) -> Result<Vec<EpisodeOutcome>, StoreError> {
    f.store.outcomes(evaluation.run).await
}

#[tokio::test]
async fn cleared_run_keeps_summary_and_loses_shards() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let jobs_before = count_rows(&f, "jobs").await;
    let evaluation = f.evaluate(submission.id, &one_shard_plan()).await;
    f.run_all_with_score(50.0).await;
    let (board_before, outcomes_before) =
        (f.board().await, outcomes(&f, &evaluation).await.unwrap());
    assert!(!outcomes_before.is_empty());
    f.advance_clock_s(RECORDINGS_KEPT_FOR.as_secs() - 1);
    assert_eq!(clearable_runs(&f).await, []);
    f.advance_clock_s(1);
    let run = evaluation.run;
    assert_eq!(unsummarised_runs(&f).await, [run]);
    assert_eq!(clearable_runs(&f).await, []);
    for (version, unsummarised, clearable) in [
        (SUMMARY_VERSION - 1, vec![run], vec![]),
        (SUMMARY_VERSION, vec![], vec![run]),
    ] {
        let stored = f
            .store
            .store_episode_summary(evaluation.run, version, "{}", f.now);
        stored.await.unwrap();
        assert_eq!(
            unsummarised_runs(&f).await,
            unsummarised,
            "version {version}"
        );
        assert_eq!(clearable_runs(&f).await, clearable, "version {version}");
    }
    assert!(
        event_kinds(&f)
            .await
            .contains(&"shard_committed".to_owned())
    );
    let change_before = f.store.newest_change().await.unwrap();

    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    assert_eq!(clearable_runs(&f).await, []);
    assert_eq!(count_rows(&f, "shards").await, 0);
    // The evaluation's scoring job stays.
    assert_eq!(count_rows(&f, "jobs").await, jobs_before + 1);
    assert!(
        !event_kinds(&f)
            .await
            .contains(&"shard_committed".to_owned())
    );
    assert!(
        event_kinds(&f)
            .await
            .contains(&"evaluation_finished".to_owned()),
        "events of results stay"
    );
    let error = outcomes(&f, &evaluation).await.unwrap_err();
    assert!(
        matches!(error, StoreError::OutcomesRemoved { at } if at == f.now),
        "{error}"
    );
    let summaries = f
        .store
        .episode_summaries(&[evaluation.run], SUMMARY_VERSION)
        .await;
    assert_eq!(summaries.unwrap()[&evaluation.run], "{}");
    let board_after = f.board().await;
    assert_eq!(board_after.len(), 1);
    assert_eq!(board_after[0].result, board_before[0].result);
    assert_eq!(
        f.store.newest_change().await.unwrap(),
        change_before,
        "boards are not affected"
    );
    // A second call changes nothing.
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
}

#[tokio::test]
async fn cleared_run_keeps_agent_faults() {
    let mut f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    while !f.state(evaluation.id).await.is_over() {
        let (claim, _, shard) = f.claim_shard().await;
        f.commit_shard_with_faults(&claim, &shard, 1).await;
    }
    let faults_before = f.store.run_faults(evaluation.run).await.unwrap();
    assert!(!faults_before.faults.is_empty());
    f.advance_clock_s(RECORDINGS_KEPT_FOR.as_secs());
    assert_eq!(
        clearable_runs(&f).await,
        [evaluation.run],
        "the run has no score, so no board needs a summary"
    );
    assert_eq!(unsummarised_runs(&f).await, []);
    let shards_before = count_rows(&f, "shards").await;
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    let shards_left = count_rows(&f, "shards").await;
    assert!(
        0 < shards_left && shards_left < shards_before,
        "{shards_left} of {shards_before}"
    );
    assert_eq!(
        f.store.run_faults(evaluation.run).await.unwrap(),
        faults_before
    );
}

#[tokio::test]
async fn open_run_is_not_clearable() {
    let mut f = TestStore::new().await;
    let evaluation = f.start_evaluation(&six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    f.advance_clock_s(30 * RECORDINGS_KEPT_FOR.as_secs());
    assert_eq!(clearable_runs(&f).await, []);
    assert_eq!(unsummarised_runs(&f).await, []);
    assert!(!outcomes(&f, &evaluation).await.unwrap().is_empty());
}
