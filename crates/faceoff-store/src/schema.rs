//! The database schema. An older database is migrated to this program's schema; one of a later version is refused.

use crate::{
    error::{Result, StoreError},
    program::Program,
    tables::program_versions,
};
use sqlx::{SqliteConnection, migrate::Migrator};

pub(crate) static MIGRATIONS: Migrator = sqlx::migrate!("../../migrations");

/// A migration from an earlier version's schema to this one's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Upgrade {
    /// The version that opened the database last; `None` if it did not record itself.
    pub from: Option<String>,
    /// Number of the newest migration before the upgrade.
    pub from_schema: i64,
    /// This version.
    pub to: Program,
}

/// This version of the program, and the newest migration that it knows.
pub(crate) fn this_program() -> Program {
    Program {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        schema: newest_migration(),
    }
}

/// Number of the newest migration.
fn newest_migration() -> i64 {
    MIGRATIONS
        .iter()
        .map(|migration| migration.version)
        .max()
        .unwrap_or_default()
}

/// Hash of all migrations, in order.
pub(crate) fn digest() -> blake3::Hash {
    let mut digest = blake3::Hasher::new();
    for migration in MIGRATIONS.iter() {
        digest.update(&migration.checksum);
    }
    digest.finalize()
}

/// State of a database before it is migrated.
#[derive(Debug)]
pub(crate) struct SchemaBefore {
    /// Number of the newest migration that was run; `None` for an empty database.
    applied: Option<i64>,
    /// The version that opened the database last, if it recorded itself.
    last: Option<Program>,
}

/// Reads the state of a database before its migration. [`StoreError::NewerDatabase`] if a later version has migrated it, so
/// that nothing may be changed.
pub(crate) async fn check_migratable(connection: &mut SqliteConnection) -> Result<SchemaBefore> {
    let (applied, last) = (
        newest_applied(connection).await?,
        program_versions::last(connection).await?,
    );
    let this = this_program();
    match applied {
        Some(schema) if schema > this.schema => Err(StoreError::NewerDatabase {
            schema,
            program: last.map(|program| program.version),
            this,
        }),
        _ => Ok(SchemaBefore { applied, last }),
    }
}

/// Records, after the migration, that this version has opened the database.
pub(crate) async fn record_program(
    connection: &mut SqliteConnection,
    before: SchemaBefore,
) -> Result<Option<Upgrade>> {
    let this = this_program();
    if before.last.as_ref() != Some(&this) {
        program_versions::put(connection, &this).await?;
    }
    Ok(before
        .applied
        .filter(|applied| *applied < this.schema)
        .map(|from_schema| Upgrade {
            from: before.last.map(|program| program.version),
            from_schema,
            to: this,
        }))
}

/// The newest migration that was run; `None` for an empty database.
pub(crate) async fn newest_applied(connection: &mut SqliteConnection) -> Result<Option<i64>> {
    let table_count: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = '_sqlx_migrations'",
    )
    .fetch_one(&mut *connection)
    .await?;
    if table_count == 0 {
        return Ok(None);
    }
    Ok(
        sqlx::query_scalar("SELECT MAX(version) FROM _sqlx_migrations")
            .fetch_one(connection)
            .await?,
    )
}
