//! Import of the database of an archive: a whole season in one file, to be shown read-only. It is untrusted input.

use crate::{
    boxed_future, column,
    error::{Result, StoreError},
    operations::scrub_archive::check_references,
    schema::MIGRATIONS,
    store::Store,
    tables::archive::{self, ArchivedSeason},
};
use jiff::Timestamp;
use sqlx::{
    Connection, SqliteConnection,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// The table in which sqlx records the migrations that were run.
const MIGRATION_TABLE: &str = "_sqlx_migrations";
/// SQLite checks the deadline each time it has executed this number of instructions.
const PROGRESS_INTERVAL: i32 = 100_000;
/// The migrations, which may copy each table, can grow an archive's database to this multiple of its size.
const MAX_GROWTH: u32 = 3;
/// In addition to [`MAX_GROWTH`], the database can grow by this number of pages (mostly of 4 KiB), since small databases need more.
const MAX_ADDED_PAGES: u32 = 1 << 14;

/// The database of a data folder.
fn database_file(data_dir: &Path) -> PathBuf {
    data_dir.join(Store::DATABASE_FILE)
}

fn refusal(reason: impl std::fmt::Display) -> StoreError {
    StoreError::Conflict(format!("the archive's database is refused: {reason}"))
}

impl Store {
    /// The archive that a data folder's season was imported from. Nothing is created or changed. `None` also if there
    /// is no database yet, or one of a version without archives.
    #[boxed_future]
    pub async fn archived_in(data_dir: &Path) -> Result<Option<ArchivedSeason>> {
        let file = database_file(data_dir);
        if !file.exists() {
            return Ok(None);
        }
        let options = SqliteConnectOptions::new().filename(file).read_only(true);
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let archived = match has_archive_table(&mut connection).await? {
            true => archive::read(&mut connection).await?,
            false => None,
        };
        connection.close().await?;
        Ok(archived)
    }

    /// Imports the database `faceoff.sqlite3` in `data_dir`, unpacked from an archive. Checks, without writing, that it has
    /// exactly the schema of this or an earlier version of the program and is intact; then migrates it and removes all
    /// credentials. The folder must not be used before this has succeeded. [`StoreError::Conflict`] if the database is
    /// refused, with the reason.
    ///
    /// The database may be made to take any time and space: so the import ends after an hour, and can grow the database only
    /// to a few times its size.
    pub async fn import(data_dir: &Path, now: Timestamp) -> Result<ArchivedSeason> {
        Self::import_within(data_dir, now, Duration::from_hours(1)).await
    }

    /// [`import`](Self::import), with this maximum duration.
    pub async fn import_within(
        data_dir: &Path,
        now: Timestamp,
        max_duration: Duration,
    ) -> Result<ArchivedSeason> {
        let deadline = Deadline {
            at: Instant::now() + max_duration,
            max_duration,
        };
        let options = SqliteConnectOptions::new()
            .filename(database_file(data_dir))
            .create_if_missing(false)
            // functions in an untrusted schema are not executed
            .pragma("trusted_schema", "OFF")
            .pragma("cell_size_check", "ON");
        let read_only = options.clone().read_only(true);
        let mut connection = deadline.connect(&read_only).await?;
        let checked = check_read_only(&mut connection).await;
        connection.close().await?;
        let page_count = deadline.refuse_if_passed(checked)?;

        let max_page_count = page_count
            .saturating_mul(MAX_GROWTH)
            .saturating_add(MAX_ADDED_PAGES);
        let writable = options
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Delete)
            .synchronous(SqliteSynchronous::Full)
            .pragma("max_page_count", max_page_count.to_string());
        let mut connection = deadline.connect(&writable).await?;
        let migrated = migrate(&mut connection, now).await;
        connection.close().await?;
        deadline.refuse_if_passed(migrated)
    }
}

/// The end of the time in which an import must be done.
#[derive(Clone, Copy)]
struct Deadline {
    at: Instant,
    max_duration: Duration,
}

impl Deadline {
    /// Opens a database whose statements end at the deadline.
    async fn connect(self, options: &SqliteConnectOptions) -> Result<SqliteConnection> {
        let mut connection = SqliteConnection::connect_with(options)
            .await
            .map_err(refusal)?;
        let mut handle = connection.lock_handle().await?;
        handle.set_progress_handler(PROGRESS_INTERVAL, move || Instant::now() < self.at);
        drop(handle);
        Ok(connection)
    }

    /// The outcome of a step, or the refusal if it ended because of the deadline.
    fn refuse_if_passed<T>(self, outcome: Result<T>) -> Result<T> {
        match outcome {
            Err(_) if Instant::now() >= self.at => Err(refusal(format_args!(
                "its check takes longer than {} minutes",
                self.max_duration.as_secs() / 60
            ))),
            outcome => outcome,
        }
    }
}

/// Checks the database without writing, and returns its number of pages. Only the text of its schema is read until that is known to be
/// the program's own, because a view in place of a table could have any number of rows.
async fn check_read_only(connection: &mut SqliteConnection) -> Result<u32> {
    let found = schema(connection).await.map_err(refusal)?;
    if !has(&found, "archived") {
        return Err(refusal("it is not that of an archived season"));
    }
    let this = reference_schema(None).await?;
    let is_migration_table = |entry: &&SchemaEntry| entry.name == MIGRATION_TABLE;
    match (
        found.iter().find(is_migration_table),
        this.iter().find(is_migration_table),
    ) {
        (found, expected) if found == expected => {}
        _ => {
            return Err(refusal(
                "its table of migrations is not as this program makes it",
            ));
        }
    }
    let limit = i64::try_from(MIGRATIONS.iter().count()).unwrap_or(i64::MAX) + 1;
    let applied: Vec<i64> =
        sqlx::query_scalar("SELECT version FROM _sqlx_migrations ORDER BY version LIMIT ?")
            .bind(limit)
            .fetch_all(&mut *connection)
            .await
            .map_err(refusal)?;
    let unknown = applied
        .iter()
        .find(|version| !MIGRATIONS.version_exists(**version));
    if let Some(version) = unknown {
        return Err(refusal(format_args!(
            "a later version of Faceoff made it (its migration {version} is not known here): use that, or a later one"
        )));
    }
    let Some(newest) = applied.last() else {
        return Err(refusal("its table of migrations is empty"));
    };
    compare_schema(&reference_schema(Some(*newest)).await?, &found)?;
    let verdict: String = sqlx::query_scalar("PRAGMA quick_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(refusal)?;
    if verdict != "ok" {
        return Err(refusal(format_args!("it is damaged: {verdict}")));
    }
    sqlx::query_scalar("PRAGMA page_count")
        .fetch_one(connection)
        .await
        .map_err(refusal)
}

async fn migrate(connection: &mut SqliteConnection, now: Timestamp) -> Result<ArchivedSeason> {
    MIGRATIONS.run(&mut *connection).await.map_err(refusal)?;
    compare_schema(&reference_schema(None).await?, &schema(connection).await?)?;
    check_references(connection).await.map_err(refusal)?;
    let archived = match archive::read(connection).await {
        Ok(Some(archived)) => archived,
        Ok(None) => return Err(refusal("its description of the archive is missing")),
        Err(error) => return Err(refusal(error)),
    };
    let now = column::Instant(now);
    let mut tx = connection.begin().await?;
    // An archive has no credentials; any that were added to it must not work here.
    sqlx::query!("/* import */ DELETE FROM tokens")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("/* import */ DELETE FROM invitations")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("/* import */ DELETE FROM webhooks")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("/* import */ UPDATE people SET password = NULL")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("/* import */ UPDATE registrations SET code_hash = randomblob(32)")
        .execute(&mut *tx)
        .await?;
    sqlx::query!(
        "UPDATE jobs SET state = 'dropped', nonce = NULL WHERE state IN ('queued', 'leased')"
    )
    .execute(&mut *tx)
    .await?;
    sqlx::query!("UPDATE archived SET imported_at = ?", now)
        .execute(&mut *tx)
        .await?;
    tx.commit().await?;
    Ok(ArchivedSeason {
        imported_at: Some(now.0),
        ..archived
    })
}

/// Does the database have the table that describes an archive?
async fn has_archive_table(connection: &mut SqliteConnection) -> Result<bool> {
    let found: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'archived'",
    )
    .fetch_one(connection)
    .await?;
    Ok(found == 1)
}

/// A part of a schema: a table, an index, a trigger or a view.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct SchemaEntry {
    kind: String,
    name: String,
    /// Its definition, without spaces and quotes, in which versions of SQLite differ.
    definition: String,
}

fn has(schema: &BTreeSet<SchemaEntry>, table: &str) -> bool {
    schema
        .iter()
        .any(|entry| entry.kind == "table" && entry.name == table)
}

/// The schema after the migrations up to this one, or all.
async fn reference_schema(newest: Option<i64>) -> Result<BTreeSet<SchemaEntry>> {
    let mut reference = SqliteConnection::connect("sqlite::memory:").await?;
    match newest {
        Some(newest) => MIGRATIONS.run_to(newest, &mut reference).await?,
        None => MIGRATIONS.run(&mut reference).await?,
    }
    let schema = schema(&mut reference).await?;
    reference.close().await?;
    Ok(schema)
}

/// Refuses a schema that differs from the migrations': an added trigger or view would run on every write or read.
fn compare_schema(expected: &BTreeSet<SchemaEntry>, found: &BTreeSet<SchemaEntry>) -> Result<()> {
    match found.symmetric_difference(expected).next() {
        None => Ok(()),
        Some(SchemaEntry { kind, name, .. }) => Err(refusal(format_args!(
            "its {kind} {name:?} is not as this program makes it"
        ))),
    }
}

/// All parts of the schema. Their number and length are bounded, far above this program's own.
async fn schema(connection: &mut SqliteConnection) -> Result<BTreeSet<SchemaEntry>> {
    let rows: Vec<(String, String, Option<String>)> = sqlx::query_as(
        "SELECT type, substr(name, 1, 200), substr(sql, 1, 100000) FROM sqlite_master LIMIT 2000",
    )
    .fetch_all(connection)
    .await?;
    let without_spaces_and_quotes = |sql: String| -> String {
        let chars = sql.chars();
        chars.filter(|c| !c.is_whitespace() && *c != '"').collect()
    };
    Ok(rows
        .into_iter()
        .map(|(kind, name, sql)| SchemaEntry {
            kind,
            name,
            definition: sql.map(without_spaces_and_quotes).unwrap_or_default(),
        })
        .collect())
}
