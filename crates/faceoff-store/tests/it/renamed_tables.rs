//! Migration 45 renames tables and columns: the content of a database of the version before it stays.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use sqlx::{
    AssertSqlSafe, Connection, SqliteConnection, migrate::Migrator, sqlite::SqliteConnectOptions,
};
use std::path::Path;

/// The first migration that the old version does not have.
const RENAMING_MIGRATION: &str = "0045";

/// Old and new names of tables.
const TABLES: [(&str, &str); 5] = [
    ("units", "jobs"),
    ("smoke_runs", "validation_runs"),
    ("finalisations", "scorings"),
    ("drafts", "proposed_evaluations"),
    ("draft_finalisations", "proposed_evaluation_scorings"),
];

/// Old and new names of columns.
const COLUMNS: [(&str, &str); 4] = [
    ("unit_id", "job_id"),
    ("draft_id", "proposed_evaluation_id"),
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
            if name.as_str() < RENAMING_MIGRATION {
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

    /// All tables of the old version with their columns.
    async fn tables(&mut self) -> Vec<(String, Vec<String>)> {
        let names: Vec<String> = sqlx::query_scalar(
            "SELECT name FROM main.sqlite_master
             WHERE type = 'table' AND name NOT LIKE 'sqlite%' AND name <> '_sqlx_migrations'",
        )
        .fetch_all(&mut self.0)
        .await
        .unwrap();
        let mut tables = Vec::new();
        for name in names {
            let columns = sqlx::query_scalar("SELECT name FROM pragma_table_info(?, 'main')")
                .bind(&name)
                .fetch_all(&mut self.0)
                .await
                .unwrap();
            tables.push((name, columns));
        }
        tables
    }

    /// Copies the rows of the current database into the old one.
    async fn fill(&mut self) {
        for (table, columns) in self.tables().await {
            let old_columns = columns.join(", ");
            let new_columns = new_columns(&columns);
            let new_table = new_name(&TABLES, &table);
            self.execute(format!(
                "DELETE FROM main.{table}; INSERT INTO main.{table} ({old_columns}) SELECT {new_columns} FROM current.{new_table}"
            ))
            .await;
        }
    }
}

fn new_columns(old: &[String]) -> String {
    let names: Vec<_> = old
        .iter()
        .map(|column| new_name(&COLUMNS, column))
        .collect();
    names.join(", ")
}

/// Rows of every renamed table: a validation run, evaluations in all states, a running trial, a tournament.
async fn filled_store() -> TestStore {
    let mut f = TestStore::new().await;
    let (submissions, stage_day) = f.released_day().await;
    let proposed = f.store.propose_reevaluation(
        Actor::Organiser,
        Reevaluation::Day(stage_day),
        "a reason",
        f.now,
    );
    proposed.await.unwrap();
    f.run_all_with_score(2.0).await;
    f.advance_clock_s(24 * 3600);
    f.evaluate(submissions[0].id, &one_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.commit_shard(&claim, &shard, 0).await;
    let cup = NewTournament {
        name: "Cup".parse().unwrap(),
        stage: None,
        rules: TournamentRules::default(),
        settings: TournamentSettings::default(),
        entrants: submissions
            .iter()
            .map(|submission| submission.team)
            .collect(),
    };
    let cup = f.store.open_tournament(Actor::Organiser, &cup, f.now);
    let round = DrawnRound {
        number: RoundNumber::FIRST,
        groups: Vec::new(),
        matchdays: vec![DrawnMatchday {
            games: vec![[submissions[0].team, submissions[1].team]],
            byes: Vec::new(),
        }],
    };
    let cup = cup.await.unwrap().id;
    let started = f.store.start_round(Actor::Organiser, cup, &round, f.now);
    started.await.unwrap();
    f
}

#[tokio::test]
async fn renamed_tables_keep_their_rows() {
    let f = filled_store().await;
    let folder = tempfile::tempdir().unwrap();
    let current = f.folder.path().join(Store::DATABASE_FILE);
    let mut old = OldDatabase::create(folder.path(), &current).await;
    old.fill().await;
    let tables = old.tables().await;
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
    for (table, columns) in &tables {
        let (table, columns) = (new_name(&TABLES, table), new_columns(columns));
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

    // The queue continues: one evaluation waits for its score, the other for its shard, and a game is queued.
    let (mut shards, mut scorings, mut games) = (0, 0, 0);
    while let Some(ClaimedJob { claim, job }) = migrated.claim().await {
        match job {
            Job::Shard { shard, .. } => {
                shards += 1;
                migrated.commit_shard(&claim, &shard, 0).await;
            }
            Job::Scoring { .. } => {
                scorings += 1;
                migrated.finish_scoring(&claim, 3.0, DATASET_KEY).await;
            }
            Job::Game { .. } => games += 1,
            Job::Validation { .. } => panic!("no validation run is queued"),
        }
    }
    assert_eq!((shards, scorings, games), (1, 2, 1));
    // The triggers use the new names: a day's cutoff cannot be changed.
    let changed = sqlx::query("UPDATE days SET cutoff_at = 0")
        .execute(&mut connection)
        .await;
    assert!(changed.unwrap_err().to_string().contains("had its cutoff"));
}
