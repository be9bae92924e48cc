//! A copy of the whole database, beside servers that go on, and what it needs of the artifacts.

use crate::{
    boxed,
    error::{Result, StoreError},
    operations::{scrub::check_references, snapshot::copy},
    schema::{self, MIGRATIONS},
    store::Store,
    tables::{
        needed::{self, Needed},
        season,
    },
};
use sqlx::{
    Connection, SqliteConnection,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::path::Path;

/// A database that was found to be whole.
#[derive(Debug)]
pub struct CheckedDatabase {
    pub season: String,
    pub schema: i64,
    /// Artifacts without which something would be missing.
    pub needed: Vec<Needed>,
}

impl Store {
    /// Copies the database of a data folder, with all that is committed, to a new file; who writes to it goes on. Takes
    /// room and time in proportion to the database.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] if there is none; if it cannot be read, or the copy not be written.
    #[boxed]
    pub async fn copy_database(data_dir: &Path, to: &Path) -> Result<()> {
        let from = data_dir.join(Self::DATABASE_FILE);
        let failed = |error| StoreError::artifact(from.display(), &error);
        if !from.try_exists().map_err(failed)? {
            return Err(StoreError::NotFound("the database faceoff.sqlite3"));
        }
        copy(&from, to).await
    }

    /// Makes sure that a database that nobody has open is whole, and of this version or an earlier one; nothing of it is
    /// changed. One of an earlier version is migrated in `scratch`, a folder, to ask it.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] with what is wrong, [`StoreError::NewerDatabase`].
    pub async fn check_database(file: &Path, scratch: &Path) -> Result<CheckedDatabase> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .read_only(true)
            // nobody writes to it, and nothing is to lie beside it afterwards
            .immutable(true)
            .pragma("trusted_schema", "OFF");
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let checked = check(&mut connection, file, scratch).await;
        connection.close().await?;
        checked
    }

    /// Lets the ids of events go on far behind those that a restored database has. Whoever followed the server knows ids
    /// that were given after the copy was made, and must not take what happens next for what it has heard of.
    ///
    /// # Errors
    /// If the database, which nobody has open, cannot be written.
    #[boxed]
    pub async fn skip_event_ids(file: &Path) -> Result<()> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .journal_mode(SqliteJournalMode::Off)
            .synchronous(SqliteSynchronous::Full)
            .pragma("trusted_schema", "OFF");
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let skipped = skip(&mut connection).await;
        connection.close().await?;
        skipped
    }
}

/// More than a server gives between two backups.
const IDS_SKIPPED: i64 = 100_000_000;

async fn skip(connection: &mut SqliteConnection) -> Result<()> {
    let counted: bool =
        sqlx::query_scalar("SELECT COUNT(*) FROM sqlite_master WHERE name = 'sqlite_sequence'")
            .fetch_one(&mut *connection)
            .await?;
    // The first versions had no events.
    if counted {
        sqlx::query("UPDATE sqlite_sequence SET seq = seq + ? WHERE name = 'events'")
            .bind(IDS_SKIPPED)
            .execute(connection)
            .await?;
    }
    Ok(())
}

async fn check(
    connection: &mut SqliteConnection,
    file: &Path,
    scratch: &Path,
) -> Result<CheckedDatabase> {
    let found: String = sqlx::query_scalar("PRAGMA integrity_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(|error| StoreError::Damaged(format!("the database: {error}")))?;
    if found != "ok" {
        return Err(StoreError::Damaged(format!("the database: {found}")));
    }
    let Some(schema) = schema::applied(connection).await? else {
        return Err(StoreError::Damaged(
            "the database: it has no tables of Faceoff's".to_owned(),
        ));
    };
    schema::before(connection).await?;
    check_references(connection).await?;
    let (season, needed) = if schema < schema::this_program().schema {
        migrated(file, &scratch.join("migrated.sqlite3")).await?
    } else {
        asked(connection).await?
    };
    Ok(CheckedDatabase {
        season,
        schema,
        needed,
    })
}

async fn asked(connection: &mut SqliteConnection) -> Result<(String, Vec<Needed>)> {
    Ok((
        season::read(connection).await?.name,
        needed::all(connection).await?,
    ))
}

/// What a copy says that was brought up to this version; it is thrown away.
async fn migrated(file: &Path, copied: &Path) -> Result<(String, Vec<Needed>)> {
    copy(file, copied).await?;
    let options = SqliteConnectOptions::new()
        .filename(copied)
        .foreign_keys(true)
        .journal_mode(SqliteJournalMode::Off)
        .synchronous(SqliteSynchronous::Off);
    let mut connection = SqliteConnection::connect_with(&options).await?;
    MIGRATIONS
        .run(&mut connection)
        .await
        .map_err(|error| StoreError::Database(error.into()))?;
    let told = asked(&mut connection).await;
    connection.close().await?;
    std::fs::remove_file(copied).map_err(|error| StoreError::artifact(copied.display(), &error))?;
    told
}
