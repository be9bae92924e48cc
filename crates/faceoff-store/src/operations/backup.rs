//! Backup and restore of the database: copying it while servers run, and checking a copy. A copy lists the artifacts
//! (files in the object store) that its rows refer to.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    operations::{archive_snapshot::copy, scrub_archive::check_references},
    schema::{self, MIGRATIONS},
    store::Store,
    tables::{
        required_artifacts::{self, RequiredArtifact},
        season,
    },
};
use sqlx::{
    Connection, SqliteConnection,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::path::Path;

/// A database that passed all checks.
#[derive(Debug)]
pub struct CheckedDatabase {
    /// Name of the season.
    pub season: String,
    /// Number of the newest migration in the database.
    pub schema: i64,
    /// Artifacts that its rows refer to.
    pub needed: Vec<RequiredArtifact>,
}

impl Store {
    /// Copies the database of a data folder, with everything committed, to a new file. Writers are not blocked. Takes
    /// disk space and time in proportion to the database.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] if there is no database; if it cannot be read, or the copy cannot be written.
    #[boxed_future]
    pub async fn copy_database(data_dir: &Path, target: &Path) -> Result<()> {
        let source = data_dir.join(Self::DATABASE_FILE);
        let unreadable = |error| StoreError::artifact(source.display(), &error);
        if !source.try_exists().map_err(unreadable)? {
            return Err(StoreError::NotFound("the database faceoff.sqlite3"));
        }
        copy(&source, target).await
    }

    /// Checks that a database is intact, and was made by this version of Faceoff or an earlier one. No process may have it
    /// open; it is not changed. A database of an earlier version is copied to the folder `scratch` and migrated there.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] with the defect, [`StoreError::NewerDatabase`].
    pub async fn check_database(file: &Path, scratch: &Path) -> Result<CheckedDatabase> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .read_only(true)
            // no process writes to it, and no extra file may be left beside it
            .immutable(true)
            .pragma("trusted_schema", "OFF");
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let checked = check(&mut connection, file, scratch).await;
        connection.close().await?;
        checked
    }

    /// Raises the next event id far above the ids in a restored database. Clients that followed the server know ids that
    /// were assigned after the copy was made. They must not mistake new events for those.
    ///
    /// # Errors
    /// If the database cannot be written. No process may have it open.
    #[boxed_future]
    pub async fn skip_event_ids(file: &Path) -> Result<()> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .journal_mode(SqliteJournalMode::Off)
            .synchronous(SqliteSynchronous::Full)
            .pragma("trusted_schema", "OFF");
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let skipped = skip_ids(&mut connection).await;
        connection.close().await?;
        skipped
    }
}

/// Number of event ids that a restore skips: more than a server assigns between two backups.
const SKIPPED_EVENT_IDS: i64 = 100_000_000;

async fn skip_ids(connection: &mut SqliteConnection) -> Result<()> {
    let has_sequences: bool =
        sqlx::query_scalar("SELECT COUNT(*) FROM sqlite_master WHERE name = 'sqlite_sequence'")
            .fetch_one(&mut *connection)
            .await?;
    // The first versions had no events.
    if has_sequences {
        sqlx::query("UPDATE sqlite_sequence SET seq = seq + ? WHERE name = 'events'")
            .bind(SKIPPED_EVENT_IDS)
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
    let verdict: String = sqlx::query_scalar("PRAGMA integrity_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(|error| StoreError::Damaged(format!("the database: {error}")))?;
    if verdict != "ok" {
        return Err(StoreError::Damaged(format!("the database: {verdict}")));
    }
    let Some(schema) = schema::newest_applied(connection).await? else {
        return Err(StoreError::Damaged(
            "the database: it has no tables of Faceoff's".to_owned(),
        ));
    };
    schema::check_migratable(connection).await?;
    check_references(connection).await?;
    let (season, needed) = if schema < schema::this_program().schema {
        read_migrated_copy(file, &scratch.join("migrated.sqlite3")).await?
    } else {
        read_contents(connection).await?
    };
    Ok(CheckedDatabase {
        season,
        schema,
        needed,
    })
}

/// The season's name and the needed artifacts.
async fn read_contents(
    connection: &mut SqliteConnection,
) -> Result<(String, Vec<RequiredArtifact>)> {
    Ok((
        season::read(connection).await?.name,
        required_artifacts::all(connection).await?,
    ))
}

/// The season's name and the needed artifacts of a database of an earlier version: read from a copy, which is migrated
/// to this version and then removed.
async fn read_migrated_copy(
    file: &Path,
    copy_file: &Path,
) -> Result<(String, Vec<RequiredArtifact>)> {
    copy(file, copy_file).await?;
    let options = SqliteConnectOptions::new()
        .filename(copy_file)
        .foreign_keys(true)
        .journal_mode(SqliteJournalMode::Off)
        .synchronous(SqliteSynchronous::Off);
    let mut connection = SqliteConnection::connect_with(&options).await?;
    MIGRATIONS.run(&mut connection).await?;
    let contents = read_contents(&mut connection).await;
    connection.close().await?;
    std::fs::remove_file(copy_file)
        .map_err(|error| StoreError::artifact(copy_file.display(), &error))?;
    contents
}
