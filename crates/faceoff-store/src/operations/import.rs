//! A database that came with an archive, taken in: whatever a stranger has put into it.

use crate::{
    boxed,
    column::Instant,
    error::{Result, StoreError},
    operations::scrub::check_references,
    schema::MIGRATIONS,
    store::Store,
    tables::archived::{self, Archived},
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
fn file_of(data_dir: &Path) -> PathBuf {
    data_dir.join("faceoff.sqlite3")
}

fn refused(why: impl std::fmt::Display) -> StoreError {
    StoreError::Conflict(format!("the archive's database is refused: {why}"))
}

impl Store {
    /// Is the season of a data folder an archive's? Nothing is made or changed; `None` also where there is no
    /// database yet, or one from before there were archives.
    #[boxed]
    pub async fn archived_in(data_dir: &Path) -> Result<Option<Archived>> {
        let file = file_of(data_dir);
        if !file.exists() {
            return Ok(None);
        }
        let options = SqliteConnectOptions::new().filename(file).read_only(true);
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let archived = match is_marked(&mut connection).await? {
            true => archived::read(&mut connection).await?,
            false => None,
        };
        connection.close().await?;
        Ok(archived)
    }

    /// Takes the database in that lies as `faceoff.sqlite3` in `data_dir`, unpacked from an archive: migrates it, makes
    /// sure that it is whole and nothing but our tables, and that no key of anybody's is in it. Run it on a folder that
    /// counts only afterwards. [`StoreError::Conflict`] if it is refused, with the reason.
    pub async fn import(data_dir: &Path, now: Timestamp) -> Result<Archived> {
        let options = SqliteConnectOptions::new()
            .filename(file_of(data_dir))
            .create_if_missing(false)
            // what its schema may have been given to run is not run
            .pragma("trusted_schema", "OFF")
            .pragma("cell_size_check", "ON")
            .foreign_keys(true)
            .journal_mode(SqliteJournalMode::Delete)
            .synchronous(SqliteSynchronous::Full);
        let mut connection = SqliteConnection::connect_with(&options)
            .await
            .map_err(refused)?;
        let checked = check(&mut connection, now).await;
        connection.close().await?;
        checked
    }
}

async fn check(connection: &mut SqliteConnection, now: Timestamp) -> Result<Archived> {
    let found: String = sqlx::query_scalar("PRAGMA quick_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(refused)?;
    if found != "ok" {
        return Err(refused(format_args!("it is damaged: {found}")));
    }
    if !is_marked(connection).await? {
        return Err(refused("it is not that of an archived season"));
    }
    MIGRATIONS.run(&mut *connection).await.map_err(|error| match error {
        MigrateError::VersionMissing(version) => refused(format_args!(
            "a later version of Faceoff made it (its migration {version} is not known here): use that, or a later one"
        )),
        error => refused(error),
    })?;
    check_schema(connection).await?;
    check_references(connection).await.map_err(refused)?;
    let archived = match archived::read(connection).await {
        Ok(Some(archived)) => archived,
        Ok(None) => return Err(refused("it does not say what it is an archive of")),
        Err(error) => return Err(refused(error)),
    };
    let now = Instant(now);
    let mut tx = connection.begin().await?;
    // An archive has none of these; what somebody has put there is worth nothing here.
    sqlx::query!("DELETE FROM tokens").execute(&mut *tx).await?;
    sqlx::query!("DELETE FROM invitations")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("UPDATE people SET password = NULL")
        .execute(&mut *tx)
        .await?;
    sqlx::query!("UPDATE registrations SET code_hash = randomblob(32)")
        .execute(&mut *tx)
        .await?;
    sqlx::query!(
        "UPDATE units SET state = 'dropped', nonce = NULL WHERE state IN ('queued', 'leased')"
    )
    .execute(&mut *tx)
    .await?;
    sqlx::query!("UPDATE archived SET imported_at = ?", now)
        .execute(&mut *tx)
        .await?;
    tx.commit().await?;
    Ok(Archived {
        imported_at: Some(now.0),
        ..archived
    })
}

/// Has it the table in which archives say what they are?
async fn is_marked(connection: &mut SqliteConnection) -> Result<bool> {
    let found: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'archived'",
    )
    .fetch_one(connection)
    .await?;
    Ok(found == 1)
}

/// Refuses what our migrations did not make: a trigger or a view would act from inside, whenever something is written
/// or read.
async fn check_schema(connection: &mut SqliteConnection) -> Result<()> {
    let mut ours = SqliteConnection::connect("sqlite::memory:").await?;
    MIGRATIONS
        .run(&mut ours)
        .await
        .map_err(|error| StoreError::Database(error.into()))?;
    let (expected, found) = (schema(&mut ours).await?, schema(connection).await?);
    ours.close().await?;
    match found.symmetric_difference(&expected).next() {
        None => Ok(()),
        Some((kind, name, _)) => Err(refused(format_args!(
            "its {kind} {name:?} is not as this program makes it"
        ))),
    }
}

/// Everything that is defined, spaces and quotes apart, in which versions of SQLite differ.
async fn schema(connection: &mut SqliteConnection) -> Result<BTreeSet<(String, String, String)>> {
    let rows: Vec<(String, String, Option<String>)> = sqlx::query_as(
        "SELECT type, name, sql FROM sqlite_master WHERE NOT (type = 'table' AND name = '_sqlx_migrations')",
    )
    .fetch_all(connection)
    .await?;
    let bare = |sql: String| -> String {
        let chars = sql.chars();
        chars.filter(|c| !c.is_whitespace() && *c != '"').collect()
    };
    Ok(rows
        .into_iter()
        .map(|(kind, name, sql)| (kind, name, sql.map(bare).unwrap_or_default()))
        .collect())
}
