//! The database's schema: brought up to this program's, and refused where it is a later one's.

use crate::{
    error::{Result, StoreError},
    program::Program,
    tables::programs,
};
use sqlx::{SqliteConnection, migrate::Migrator};

pub(crate) static MIGRATIONS: Migrator = sqlx::migrate!("../../migrations");

/// A database of an earlier version was brought up to this one's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Upgrade {
    /// What opened it last; `None` of a version that did not say.
    pub from: Option<String>,
    /// Its newest migration before.
    pub from_schema: i64,
    pub to: Program,
}

/// This version of the program, and the newest migration that it knows.
pub(crate) fn this_program() -> Program {
    Program {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        schema: newest(),
    }
}

fn newest() -> i64 {
    MIGRATIONS
        .iter()
        .map(|migration| migration.version)
        .max()
        .unwrap_or_default()
}

/// Of all migrations, in their order.
pub(crate) fn digest() -> blake3::Hash {
    let mut digest = blake3::Hasher::new();
    for migration in MIGRATIONS.iter() {
        digest.update(&migration.checksum);
    }
    digest.finalize()
}

/// What a database says of itself before it is migrated.
#[derive(Debug)]
pub(crate) struct Before {
    applied: Option<i64>,
    last: Option<Program>,
}

/// [`StoreError::NewerDatabase`] if a later version has migrated it: then nothing may be changed.
pub(crate) async fn before(connection: &mut SqliteConnection) -> Result<Before> {
    let (applied, last) = (
        applied(connection).await?,
        programs::last(connection).await?,
    );
    let this = this_program();
    match applied {
        Some(schema) if schema > this.schema => Err(StoreError::NewerDatabase {
            schema,
            program: last.map(|program| program.version),
            this,
        }),
        _ => Ok(Before { applied, last }),
    }
}

/// Notes, once it is migrated, who has it open.
pub(crate) async fn after(
    connection: &mut SqliteConnection,
    before: Before,
) -> Result<Option<Upgrade>> {
    let this = this_program();
    if before.last.as_ref() != Some(&this) {
        programs::put(connection, &this).await?;
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

/// The newest migration that was run; `None` of an empty database.
pub(crate) async fn applied(connection: &mut SqliteConnection) -> Result<Option<i64>> {
    let found: i64 = sqlx::query_scalar(
        "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = '_sqlx_migrations'",
    )
    .fetch_one(&mut *connection)
    .await?;
    if found == 0 {
        return Ok(None);
    }
    Ok(
        sqlx::query_scalar("SELECT MAX(version) FROM _sqlx_migrations")
            .fetch_one(connection)
            .await?,
    )
}
