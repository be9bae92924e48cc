//! Time to read a season's board: 200 teams, evaluated on each of 120 days, with a new submission
//! every tenth day. The goal is 10 ms. Run it with `cargo bench -p faceoff-store`.
#![expect(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use criterion::{Criterion, criterion_group, criterion_main};
use faceoff_airhockey::{EVALUATION, TASKS};
use faceoff_store::Store;
use faceoff_types::{
    ComputationTimeSummary, EvaluationId, EvaluationResult, IanaTimeZone, RunId, Seed, ShardId,
    StageId, StageRules, StageSettings, SubmissionId, TaskResult, TeamId, Tier, ViolationCounts,
};
use jiff::{Timestamp, ToSpan, civil::date};
use sqlx::{Connection, SqliteConnection};
use std::{hint::black_box, path::Path};
use uuid::Uuid;

/// Number of teams.
const TEAMS: usize = 200;
/// Number of days on which each team is evaluated.
const DAYS: i64 = 120;
/// Number of days after which a team makes a new submission.
const DAYS_PER_SUBMISSION: i64 = 10;
/// Maximum size of the stored standard error of an agent.
const LOG_BYTES: usize = 64 * 1024;
/// Size of a stored summary of 3 × 1000 episodes.
const SUMMARY_BYTES: usize = 1500;

fn evaluation_result(score: f64) -> EvaluationResult {
    let task = TaskResult {
        episodes: 1000,
        successes: 512,
        success_rate: 0.512,
        success_ci95: [0.481, 0.543],
        penalty_points: 327.5,
        violations: ViolationCounts::default(),
        tier: Some(Tier::Deployable),
        steps: 123_456,
        computation_time_s: ComputationTimeSummary {
            mean: 2e-4,
            p99: 9e-4,
            max: 0.012,
        },
    };
    EvaluationResult {
        ruleset: faceoff_airhockey::RULESET.to_string(),
        profile: EVALUATION,
        seed: Seed::from_number(1),
        tasks: TASKS.map(|name| (name, task.clone())).into(),
        score,
        penalty_points: 327.5,
        tier: Some(Tier::Deployable),
        timing: None,
        variation: Default::default(),
    }
}

/// Inserts the season by SQL in one transaction; the store's operations would need a hundred thousand
/// commits.
async fn insert_season(folder: &Path, stage: StageId) {
    let url = format!("sqlite://{}", folder.join("faceoff.sqlite3").display());
    let mut connection = SqliteConnection::connect(&url).await.unwrap();
    let mut tx = connection.begin().await.unwrap();
    let (log, stage) = ("x".repeat(LOG_BYTES), stage.to_string());
    for team_number in 0..TEAMS {
        let team = TeamId::new().to_string();
        sqlx::query("INSERT INTO teams (id, name, created_at) VALUES (?, ?, 0)")
            .bind(&team)
            .bind(format!("Team {team_number}"))
            .execute(&mut *tx)
            .await
            .unwrap();
        let mut submission = String::new();
        for day_number in 0..DAYS {
            if day_number % DAYS_PER_SUBMISSION == 0 {
                submission = SubmissionId::new().to_string();
                sqlx::query(
                    "INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3,
                                              bundle_file_name, created_at, agent_name, state, log)
                     VALUES (?, ?, 'bundles/x', 1, 'x', 'agent.zip', ?, 'agent', 'valid', ?)",
                )
                .bind(&submission)
                .bind(&team)
                .bind(day_number)
                .bind(&log)
                .execute(&mut *tx)
                .await
                .unwrap();
            }
            let day = date(2026, 1, 1)
                .saturating_add(day_number.days())
                .to_string();
            if team_number == 0 {
                sqlx::query(
                    "INSERT INTO days (stage_id, day, cutoff_at, released_at) VALUES (?, ?, 0, 0)",
                )
                .bind(&stage)
                .bind(&day)
                .execute(&mut *tx)
                .await
                .unwrap();
            }
            let (run, job) = (RunId::new().to_string(), Uuid::now_v7().to_string());
            sqlx::query(
                r#"INSERT INTO runs (id, profile, seed, tasks, episodes_per_task, episodes_per_shard, max_faults,
                                     keeps_recordings, state, recordings_removed_at)
                   VALUES (?, 'evaluation', ?, '["hit","defend","prepare"]', 1000, 50, 10, 1, 'played', 0)"#,
            )
            .bind(&run)
            .bind(&day)
            .execute(&mut *tx)
            .await
            .unwrap();
            sqlx::query(
                "INSERT INTO jobs (id, kind, state, claimable_at, worker, nonce)
                 VALUES (?, 'shard', 'done', 0, 'w', 'n')",
            )
            .bind(&job)
            .execute(&mut *tx)
            .await
            .unwrap();
            sqlx::query(
                "INSERT INTO shards (id, run_id, job_id, position, task, first_episode, end_episode, committed_at,
                                     recording, agent_faults, outcomes, log)
                 VALUES (?, ?, ?, 0, 'hit', 0, 1000, 0, 'recordings/x', 0, '[]', '')",
            )
            .bind(ShardId::new().to_string())
            .bind(&run)
            .bind(&job)
            .execute(&mut *tx)
            .await
            .unwrap();
            let result = evaluation_result(40.0 + team_number as f64 / 10.0);
            sqlx::query(
                "INSERT INTO evaluations (id, purpose, submission_id, team_id, stage_id, day, revision, run_id, created_at,
                                          state, finished_at, dataset, dataset_blake3, result)
                 VALUES (?, 'counting', ?, ?, ?, ?, 1, ?, ?, 'finished', ?, 'datasets/x.zip', 'x', ?)",
            )
            .bind(EvaluationId::new().to_string())
            .bind(&submission)
            .bind(&team)
            .bind(&stage)
            .bind(&day)
            .bind(&run)
            .bind(day_number)
            .bind(day_number)
            .bind(serde_json::to_string(&result).unwrap())
            .execute(&mut *tx)
            .await
            .unwrap();
            sqlx::query(
                "INSERT INTO episode_summaries (run_id, version, summary) VALUES (?, 1, ?)",
            )
            .bind(&run)
            .bind("y".repeat(SUMMARY_BYTES))
            .execute(&mut *tx)
            .await
            .unwrap();
        }
    }
    tx.commit().await.unwrap();
    connection.close().await.unwrap();
}

#[expect(clippy::print_stderr, reason = "a benchmark reports to a terminal")]
fn board(criterion: &mut Criterion) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (store, stage) = runtime.block_on(async {
        let store = Store::open(folder.path()).await.unwrap();
        let now = Timestamp::now();
        let rules = StageRules {
            runtimes: None,
            ruleset: faceoff_airhockey::RULESET,
            profile: EVALUATION,
            tasks: TASKS.to_vec(),
            episodes_per_task: 1000,
            max_faults: 10,
            variation: Default::default(),
            limits: Default::default(),
        };
        store
            .configure_stage(rules, StageSettings::default(), IanaTimeZone::UTC, now)
            .await
            .unwrap();
        let stage = store.stages().await.unwrap().remove(0).id;
        drop(store);
        insert_season(folder.path(), stage).await;
        (Store::open(folder.path()).await.unwrap(), stage)
    });
    let bytes = std::fs::metadata(folder.path().join("faceoff.sqlite3"))
        .unwrap()
        .len();
    eprintln!("the database: {} MB", bytes / 1_000_000);
    let records = runtime.block_on(store.board(stage, 1)).unwrap();
    assert_eq!(records.len(), TEAMS);
    let runs: Vec<_> = records.iter().map(|record| record.run).collect();
    criterion.bench_function("board of 200 teams × 120 days", |bencher| {
        bencher.iter(|| black_box(runtime.block_on(store.board(stage, 1)).unwrap()));
    });
    criterion.bench_function("episode summaries of the board", |bencher| {
        bencher.iter(|| black_box(runtime.block_on(store.episode_summaries(&runs, 1)).unwrap()));
    });
}

criterion_group!(benches, board);
criterion_main!(benches);
