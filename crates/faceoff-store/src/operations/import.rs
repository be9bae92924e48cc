//! Import of the database of an archive: a whole season in one file, to be shown read-only. It is untrusted input.

use crate::{
    boxed,
    column::Instant,
    error::{Result, StoreError},
    operations::scrub::check_references,
    schema::MIGRATIONS,
    store::Store,
    tables::archive::{self, ArchivedSeason},
};
use jiff::Timestamp;
use sqlx::{
    Connection, SqliteConnection,
    migrate::MigrateError,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

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
    #[boxed]
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

    /// Imports the database `faceoff.sqlite3` in `data_dir`, unpacked from an archive. Migrates it, checks that it is
    /// intact and has exactly this program's schema, and removes all credentials. The folder must not be used before
    /// this has succeeded. [`StoreError::Conflict`] if the database is refused, with the reason.
    pub async fn import(data_dir: &Path, now: Timestamp) -> Result<ArchivedSeason> {
        let options = SqliteConnectOptions::new()
            .filename(database_file(data_dir))
            .create_if_missing(false)
            // functions in an untrusted schema are not executed
            .pragma("trusted_schema", "OFF")
            .pragma("cell_size_check", "ON")
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Delete)
            .synchronous(SqliteSynchronous::Full);
        let mut connection = SqliteConnection::connect_with(&options)
            .await
            .map_err(refusal)?;
        let checked = check(&mut connection, now).await;
        connection.close().await?;
        checked
    }
}

async fn check(connection: &mut SqliteConnection, now: Timestamp) -> Result<ArchivedSeason> {
    let verdict: String = sqlx::query_scalar("PRAGMA quick_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(refusal)?;
    if verdict != "ok" {
        return Err(refusal(format_args!("it is damaged: {verdict}")));
    }
    if !has_archive_table(connection).await? {
        return Err(refusal("it is not that of an archived season"));
    }
    MIGRATIONS.run(&mut *connection).await.map_err(|error| match error {
        MigrateError::VersionMissing(version) => refusal(format_args!(
            "a later version of Faceoff made it (its migration {version} is not known here): use that, or a later one"
        )),
        error => refusal(error),
    })?;
    check_schema(connection).await?;
    check_references(connection).await.map_err(refusal)?;
    let archived = match archive::read(connection).await {
        Ok(Some(archived)) => archived,
        Ok(None) => return Err(refusal("its description of the archive is missing")),
        Err(error) => return Err(refusal(error)),
    };
    let now = Instant(now);
    let mut tx = connection.begin().await?;
    // An archive has no credentials; any that were added to it must not work here.
    sqlx::query!("DELETE FROM tokens").execute(&mut *tx).await?;
    sqlx::query!("DELETE FROM invitations")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("DELETE FROM webhooks")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("UPDATE people SET password = NULL")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("UPDATE registrations SET code_hash = randomblob(32)")
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

/// Refuses a schema that differs from the migrations': an added trigger or view would run on every write or
/// read.
async fn check_schema(connection: &mut SqliteConnection) -> Result<()> {
    let mut reference = SqliteConnection::connect("sqlite::memory:").await?;
    MIGRATIONS.run(&mut reference).await?;
    let (expected, found) = (schema(&mut reference).await?, schema(connection).await?);
    reference.close().await?;
    match found.symmetric_difference(&expected).next() {
        None => Ok(()),
        Some((kind, name, _)) => Err(refusal(format_args!(
            "its {kind} {name:?} is not as this program makes it"
        ))),
    }
}

/// All schema definitions, without spaces and quotes, in which versions of SQLite differ.
async fn schema(connection: &mut SqliteConnection) -> Result<BTreeSet<(String, String, String)>> {
    let rows: Vec<(String, String, Option<String>)> = sqlx::query_as(
        "SELECT type, name, sql FROM sqlite_master WHERE NOT (type = 'table' AND name = '_sqlx_migrations')",
    )
    .fetch_all(connection)
    .await?;
    let without_spaces_and_quotes = |sql: String| -> String {
        let chars = sql.chars();
        chars.filter(|c| !c.is_whitespace() && *c != '"').collect()
    };
    Ok(rows
        .into_iter()
        .map(|(kind, name, sql)| {
            (
                kind,
                name,
                sql.map(without_spaces_and_quotes).unwrap_or_default(),
            )
        })
        .collect())
}
