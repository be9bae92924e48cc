use crate::{
    Store, StoreError,
    column::{Bytes32, Instant},
    database::Database,
};
use faceoff_types::Seed;
use jiff::Timestamp;

/// The season: one per data folder.
#[derive(Debug, Clone)]
pub struct Season {
    /// The name shown to teams.
    pub name: String,
    /// All seeds derive from it; published when the season closes.
    pub secret: Seed,
    /// BLAKE3 of the secret's 32 bytes, 64 hexadecimal digits; published before the season opens, so
    /// that nobody can choose the episodes afterwards.
    pub commitment: String,
    /// When the data folder was first opened.
    pub created_at: Timestamp,
}

impl Store {
    /// The season.
    pub async fn season(&self) -> Result<Season, StoreError> {
        let row = sqlx::query!(
            r#"SELECT name, secret AS "secret: Bytes32", created_at AS "created_at: Instant" FROM season"#
        )
        .fetch_optional(&self.database.read)
        .await?
        .ok_or_else(|| StoreError::Damaged("the season is missing".into()))?;
        Ok(Season {
            name: row.name,
            secret: Seed::from_bytes(row.secret.0),
            commitment: blake3::hash(&row.secret.0).to_string(),
            created_at: row.created_at.0,
        })
    }
}

/// Gives a new data folder its season, with a secret from the operating system's generator.
pub(crate) async fn draw_secret_once(database: &Database) -> Result<(), StoreError> {
    let mut secret = [0; 32];
    getrandom::fill(&mut secret)
        .map_err(|error| StoreError::Database(sqlx::Error::Io(std::io::Error::other(error))))?;
    let secret = Bytes32(secret);
    let mut tx = database.begin().await?;
    sqlx::query!(
        "INSERT INTO season (id, name, secret, created_at)
         VALUES (1, 'Season 1', ?, CAST(unixepoch('subsec') * 1000 AS INTEGER))
         ON CONFLICT (id) DO NOTHING",
        secret,
    )
    .execute(&mut *tx)
    .await?;
    Ok(tx.commit().await?)
}
