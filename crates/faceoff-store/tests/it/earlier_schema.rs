//! Migration 45 renames tables and columns, and migration 46 moves the evaluations of proposals into the table of
//! evaluations: the content of a database of the version before them stays.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use sqlx::{
    AssertSqlSafe, Connection, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions,
};
use std::path::Path;

/// The first migration that the old version does not have.
const FIRST_NEW_MIGRATION: &str = "0045";

/// Old tables, and the tables, views and queries of the new version with their rows.
const TABLES: [(&str, &str); 6] = [
    ("units", "current.jobs"),
    ("smoke_runs", "current.validation_runs"),
    ("evaluations", "current.counting_evaluations"),
    (
        "finalisations",
        "current.scorings WHERE evaluation_id IN (SELECT id FROM current.counting_evaluations)",
    ),
    (
        "drafts",
        "current.evaluations WHERE proposal_id IS NOT NULL",
    ),
    (
        "draft_finalisations",
        "current.scorings WHERE evaluation_id IN
         (SELECT id FROM current.evaluations WHERE proposal_id IS NOT NULL)",
    ),
];

/// Old and new names of columns.
const COLUMNS: [(&str, &str); 5] = [
    ("unit_id", "job_id"),
    ("draft_id", "evaluation_id"),
    ("replaces", "rerun_of"),
    ("meeting", "pairing"),
    ("cut_at", "cutoff_at"),
];

fn new_name<'a>(names: &[(&str, &'a str)], old: &'a str) -> &'a str {
    let renamed = names.iter().find(|(name, _)| *name == old);
    renamed.map_or(old, |(_, new)| *new)
}

/// A database of the old version, as `main`, next to a current one, as `current`.
struct OldDatabase(SqliteConnection);

impl OldDatabase {
    /// Creates an empty database of the old version in `folder`.
    async fn create(folder: &Path, current: &Path) -> Self {
        let migrations = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../migrations");
        let old_migrations = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(migrations).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            if name.as_str() < FIRST_NEW_MIGRATION {
                std::fs::copy(entry.path(), old_migrations.path().join(name)).unwrap();
            }
        }
        let options = SqliteConnectOptions::new()
            .filename(folder.join(Store::DATABASE_FILE))
            .create_if_missing(true)
            .foreign_keys(false);
        let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
        let migrator = Migrator::new(old_migrations.path()).await.unwrap();
        migrator.run(&mut connection).await.unwrap();
        let mut database = Self(connection);
        database
            .execute(format!("ATTACH '{}' AS current", current.display()))
            .await;
        database
    }

    async fn execute(&mut self, sql: String) {
        let executed = sqlx::raw_sql(AssertSqlSafe(sql.clone()))
            .execute(&mut self.0)
            .await;
        if let Err(error) = executed {
            panic!("{error} in {sql}");
        }
    }

    /// Copies the rows of the current database into the old one.
    async fn fill(&mut self) {
        for (table, columns) in tables(&mut self.0, "main").await {
            let renamed: Vec<_> = columns
                .iter()
                .map(|column| new_name(&COLUMNS, column))
                .collect();
            let (old_columns, new_columns) = (columns.join(", "), renamed.join(", "));
            let unchanged = format!("current.{table}");
            let source = new_name(&TABLES, &table);
            let source = if source == table { &unchanged } else { source };
            self.execute(format!(
                "DELETE FROM main.{table}; INSERT INTO main.{table} ({old_columns}) SELECT {new_columns} FROM {source}"
            ))
            .await;
        }
    }
}

/// All tables of a database with their columns.
async fn tables(connection: &mut SqliteConnection, schema: &str) -> Vec<(String, Vec<String>)> {
    let names: Vec<String> = sqlx::query_scalar(AssertSqlSafe(format!(
        "SELECT name FROM {schema}.sqlite_master
         WHERE type = 'table' AND name NOT LIKE 'sqlite%' AND name NOT IN ('_sqlx_migrations', 'programs')",
    )))
    .fetch_all(&mut *connection)
    .await
    .unwrap();
    let mut tables = Vec::new();
    for name in names {
        let columns = sqlx::query_scalar("SELECT name FROM pragma_table_info(?, ?)")
            .bind(&name)
            .bind(schema)
            .fetch_all(&mut *connection)
            .await
            .unwrap();
        tables.push((name, columns));
    }
    tables
}

/// Rows of every changed table: a validation run, evaluations in all states, a trial that was dropped and has lost its
/// dataset, an applied re-evaluation, a running one, a tournament.
async fn filled_store() -> TestStore {
    let mut f = TestStore::new().await;
    let (submissions, stage_day) = f.released_day().await;
    let trial = f
        .store
        .propose_trial(Actor::Operator, stage_day.stage, None, "a reason", f.now);
    let trial = trial.await.unwrap().id;
    f.run_all_with_score(2.0).await;
    let dropped = f.store.drop_proposal(Actor::Operator, trial, f.now);
    dropped.await.unwrap();
    f.advance_clock_s(25 * 3600);
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 2);
    for is_applied in [true, false] {
        let proposed = f.store.propose_reevaluation(
            Actor::Operator,
            Reevaluation::Day(stage_day),
            "a reason",
            f.now,
        );
        let proposed = proposed.await.unwrap().id;
        if is_applied {
            f.run_all_with_score(2.0).await;
            let applied = f.store.apply_proposal(Actor::Operator, proposed, f.now);
            applied.await.unwrap();
        }
    }
    f.advance_clock_s(24 * 3600);
    f.evaluate(submissions[0].id, &one_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard).await;
    let cup = NewTournament {
        name: "Cup".parse().unwrap(),
        stage: None,
        rules: faceoff_airhockey::competition().tournament_rules(),
        settings: TournamentSettings::default(),
        entrants: submissions
            .iter()
            .map(|submission| submission.team)
            .collect(),
    };
    let cup = f.store.open_tournament(Actor::Operator, &cup, f.now);
    let round = DrawnRound {
        number: RoundNumber::FIRST,
        groups: Vec::new(),
        matchdays: vec![DrawnMatchday {
            games: vec![[submissions[0].team, submissions[1].team]],
            byes: Vec::new(),
        }],
    };
    let cup = cup.await.unwrap().id;
    let started = f.store.start_round(Actor::Operator, cup, &round, f.now);
    started.await.unwrap();
    f
}

#[tokio::test]
async fn earlier_schema_is_migrated_with_all_rows() {
    let f = filled_store().await;
    let folder = tempfile::tempdir().unwrap();
    let current = f.folder.path().join(Store::DATABASE_FILE);
    let mut old = OldDatabase::create(folder.path(), &current).await;
    old.fill().await;
    for (name, _) in TABLES {
        let sql = format!("SELECT COUNT(*) FROM main.{name}");
        let count: i64 = sqlx::query_scalar(AssertSqlSafe(sql))
            .fetch_one(&mut old.0)
            .await
            .unwrap();
        assert!(count > 0, "{name} is filled");
    }
    old.0.close().await.unwrap();

    let migrated = TestStore {
        store: Store::open(folder.path()).await.unwrap(),
        folder,
        now: f.now,
    };
    let mut connection = migrated.connection().await;
    let attached = sqlx::query("ATTACH ? AS before")
        .bind(current.to_str().unwrap())
        .execute(&mut connection)
        .await;
    attached.unwrap();
    for (table, columns) in tables(&mut connection, "before").await {
        // The old version stored the slot time of counting evaluations only.
        let columns = columns
            .join(", ")
            .replace("slot_ms", "CASE purpose WHEN 'counting' THEN slot_ms END");
        for (schema, other_schema) in [("before", "main"), ("main", "before")] {
            let sql = format!(
                "SELECT COUNT(*) FROM (SELECT {columns} FROM {schema}.{table} EXCEPT SELECT {columns} FROM {other_schema}.{table})"
            );
            let difference: i64 = sqlx::query_scalar(AssertSqlSafe(sql))
                .fetch_one(&mut connection)
                .await
                .unwrap();
            assert_eq!(difference, 0, "rows of {table} that only {schema} has");
        }
    }
    let dangling_references = sqlx::query("PRAGMA main.foreign_key_check")
        .fetch_all(&mut connection)
        .await
        .unwrap();
    assert!(dangling_references.is_empty());

    // The queue continues: one evaluation waits for its score, the others for their shards, and a game is queued.
    let (mut shards, mut scorings, mut games) = (0, 0, 0);
    while let Some(ClaimedJob { claim, job }) = migrated.claim().await {
        match job {
            Job::Shard { shard, .. } => {
                shards += 1;
                migrated.commit_shard(&claim, &shard).await;
            }
            Job::Scoring { .. } => {
                scorings += 1;
                migrated.finish_scoring(&claim, 3.0, DATASET_KEY).await;
            }
            Job::Game { .. } => games += 1,
            Job::Validation { .. } => panic!("no validation run is queued"),
        }
    }
    assert_eq!((shards, scorings, games), (3, 4, 1));
    // The triggers use the new names: a day's cutoff cannot be changed.
    let changed = sqlx::query("UPDATE days SET cutoff_at = 0")
        .execute(&mut connection)
        .await;
    assert!(changed.unwrap_err().to_string().contains("had its cutoff"));
}
