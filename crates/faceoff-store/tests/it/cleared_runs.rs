//! Removal of the rows of runs that ended long ago.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::EpisodeOutcome;

const VERSION: u32 = 7;

async fn clearable(f: &TestStore) -> Vec<ClearableRun> {
    f.store.clearable_runs(VERSION, f.now).await.unwrap()
}

async fn rows(f: &TestStore, table: &str) -> i64 {
    let sql = format!("SELECT COUNT(*) FROM {table}");
    sqlx::query_scalar(sqlx::AssertSqlSafe(sql))
        .fetch_one(&mut f.connection().await)
        .await
        .unwrap()
}

async fn kinds(f: &TestStore) -> Vec<String> {
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
    let submission = f.ready_team("Alpha").await;
    let jobs_before = rows(&f, "jobs").await;
    let evaluation = f.evaluate(submission.id, &small()).await;
    f.run_all(50.0).await;
    let (board, outcomes_before) = (f.board().await, outcomes(&f, &evaluation).await.unwrap());
    assert!(!outcomes_before.is_empty());
    f.later(RECORDINGS_KEPT_FOR.as_secs() - 1);
    assert_eq!(clearable(&f).await, []);
    f.later(1);
    let wants = |needs_summary| ClearableRun {
        run: evaluation.run,
        needs_summary,
    };
    assert_eq!(clearable(&f).await, [wants(true)]);
    for (version, wanted) in [(VERSION - 1, true), (VERSION, false)] {
        let keep = f
            .store
            .store_episode_summary(evaluation.run, version, "{}", f.now);
        keep.await.unwrap();
        assert_eq!(clearable(&f).await, [wants(wanted)], "version {version}");
    }
    assert!(kinds(&f).await.contains(&"shard_committed".to_owned()));
    let change = f.store.newest_change().await.unwrap();

    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    assert_eq!(clearable(&f).await, []);
    assert_eq!(rows(&f, "shards").await, 0);
    // The evaluation's scoring job stays.
    assert_eq!(rows(&f, "jobs").await, jobs_before + 1);
    assert!(!kinds(&f).await.contains(&"shard_committed".to_owned()));
    assert!(
        kinds(&f).await.contains(&"evaluation_finished".to_owned()),
        "events of results stay"
    );
    let gone = outcomes(&f, &evaluation).await.unwrap_err();
    assert!(
        matches!(gone, StoreError::OutcomesRemoved { at } if at == f.now),
        "{gone}"
    );
    let summaries = f.store.episode_summaries(&[evaluation.run], VERSION).await;
    assert_eq!(summaries.unwrap()[&evaluation.run], "{}");
    let after = f.board().await;
    assert_eq!(after.len(), 1);
    assert_eq!(after[0].result, board[0].result);
    assert_eq!(
        f.store.newest_change().await.unwrap(),
        change,
        "boards are not affected"
    );
    // A second call changes nothing.
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
}

#[tokio::test]
async fn cleared_run_keeps_agent_faults() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 0).await;
    while !f.state(evaluation.id).await.is_over() {
        let (claim, _, shard) = f.claim_shard().await;
        f.commit_shard(&claim, &shard, 1).await;
    }
    let faults_before = f.store.run_faults(evaluation.run).await.unwrap();
    assert!(!faults_before.faults.is_empty());
    f.later(RECORDINGS_KEPT_FOR.as_secs());
    assert_eq!(
        clearable(&f).await,
        [ClearableRun {
            run: evaluation.run,
            needs_summary: false
        }],
        "it has no score, so no board needs a summary"
    );
    let before = rows(&f, "shards").await;
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    let left = rows(&f, "shards").await;
    assert!(0 < left && left < before, "{left} of {before}");
    assert_eq!(
        f.store.run_faults(evaluation.run).await.unwrap(),
        faults_before
    );
}

#[tokio::test]
async fn open_run_is_not_clearable() {
    let mut f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 0).await;
    f.later(30 * RECORDINGS_KEPT_FOR.as_secs());
    assert_eq!(clearable(&f).await, []);
    assert!(!outcomes(&f, &evaluation).await.unwrap().is_empty());
}
