//! What is left in the database of runs that are long over.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::EpisodeOutcome;

const VERSION: u32 = 7;

async fn clearable(f: &Fixture) -> Vec<Clearable> {
    f.store.clearable_runs(VERSION, f.now).await.unwrap()
}

async fn rows(f: &Fixture, table: &str) -> i64 {
    let sql = format!("SELECT COUNT(*) FROM {table}");
    sqlx::query_scalar(sqlx::AssertSqlSafe(sql))
        .fetch_one(&mut f.connection().await)
        .await
        .unwrap()
}

async fn kinds(f: &Fixture) -> Vec<String> {
    let sql = "SELECT kind FROM events ORDER BY id";
    let kinds = sqlx::query_scalar(sql);
    kinds.fetch_all(&mut f.connection().await).await.unwrap()
}

async fn outcomes(f: &Fixture, evaluation: &Evaluation) -> Result<Vec<EpisodeOutcome>, StoreError> {
    f.store.outcomes(evaluation.run).await
}

#[tokio::test]
async fn of_a_played_run_the_summary_stays_and_the_shards_go_a_day_later() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let units_before = rows(&f, "units").await;
    let evaluation = f.evaluate(submission.id, &small()).await;
    f.play_to(50.0).await;
    let (board, kept) = (f.board().await, outcomes(&f, &evaluation).await.unwrap());
    assert!(!kept.is_empty());
    f.later(RECORDINGS_KEPT.as_secs() - 1);
    assert_eq!(clearable(&f).await, []);
    f.later(1);
    let wants = |wants_summary| Clearable {
        run: evaluation.run,
        wants_summary,
    };
    assert_eq!(clearable(&f).await, [wants(true)]);
    for (version, wanted) in [(VERSION - 1, true), (VERSION, false)] {
        let keep = f
            .store
            .keep_episode_summary(evaluation.run, version, "{}", f.now);
        keep.await.unwrap();
        assert_eq!(clearable(&f).await, [wants(wanted)], "version {version}");
    }
    assert!(kinds(&f).await.contains(&"shard_committed".to_owned()));
    let change = f.store.newest_change().await.unwrap();

    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    assert_eq!(clearable(&f).await, []);
    assert_eq!(rows(&f, "shards").await, 0);
    // That of the score is one of each evaluation, and stays.
    assert_eq!(rows(&f, "units").await, units_before + 1);
    assert!(!kinds(&f).await.contains(&"shard_committed".to_owned()));
    assert!(
        kinds(&f).await.contains(&"evaluation_finished".to_owned()),
        "what counts is still told"
    );
    let gone = outcomes(&f, &evaluation).await.unwrap_err();
    assert!(
        matches!(gone, StoreError::Cleared { at } if at == f.now),
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
        "no board is another for it"
    );
    // Twice is as once.
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
}

#[tokio::test]
async fn what_an_agent_did_wrong_is_still_told() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    while !f.state(evaluation.id).await.is_over() {
        let (claim, _, shard) = f.claim_shard().await;
        f.play(&claim, &shard, 1).await;
    }
    let told = f.store.run_faults(evaluation.run).await.unwrap();
    assert!(!told.faults.is_empty());
    f.later(RECORDINGS_KEPT.as_secs());
    assert_eq!(
        clearable(&f).await,
        [Clearable {
            run: evaluation.run,
            wants_summary: false
        }],
        "it has no score, and no board asks for it"
    );
    let before = rows(&f, "shards").await;
    f.store.clear_run(evaluation.run, f.now).await.unwrap();
    let left = rows(&f, "shards").await;
    assert!(0 < left && left < before, "{left} of {before}");
    assert_eq!(f.store.run_faults(evaluation.run).await.unwrap(), told);
}

#[tokio::test]
async fn what_is_under_way_is_left_alone() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.play(&claim, &shard, 0).await;
    f.later(30 * RECORDINGS_KEPT.as_secs());
    assert_eq!(clearable(&f).await, []);
    assert!(!outcomes(&f, &evaluation).await.unwrap().is_empty());
}
