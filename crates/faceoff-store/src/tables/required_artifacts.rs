//! Artifacts (files in the object store) that the database refers to. A complete backup must contain them.

use crate::error::Result;
use sqlx::SqliteConnection;

/// An artifact that the database refers to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RequiredArtifact {
    File {
        key: String,
        /// BLAKE3, 64 hexadecimal digits; `None` for files of older versions.
        blake3: Option<String>,
    },
    /// At least one file under a key prefix: the recording of a shard of a running evaluation.
    Folder { key: String },
}

/// All required artifacts. A bundle that is not validated yet is left out: it may turn out
/// invalid and be removed at any time.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<RequiredArtifact>> {
    let mut required = Vec::new();
    let bundles = sqlx::query!(
        "/* backup */ SELECT bundle_key, bundle_blake3 FROM submissions WHERE state = 'valid' AND bundle_removed_at IS NULL
         ORDER BY created_at, id"
    )
    .fetch_all(&mut *connection)
    .await?;
    required.extend(bundles.into_iter().map(|row| RequiredArtifact::File {
        key: row.bundle_key,
        blake3: Some(row.bundle_blake3),
    }));
    let datasets = sqlx::query!(
        r#"/* backup */ SELECT dataset AS "dataset!", dataset_blake3 FROM evaluations
           WHERE dataset IS NOT NULL AND dataset_removed_at IS NULL
             AND NOT EXISTS (SELECT 1 FROM proposals p WHERE p.id = proposal_id AND p.outcome = 'dropped')
           ORDER BY 1"#
    )
    .fetch_all(&mut *connection)
    .await?;
    required.extend(datasets.into_iter().map(|row| RequiredArtifact::File {
        key: row.dataset,
        blake3: row.dataset_blake3,
    }));
    let recordings = sqlx::query_scalar!(
        r#"/* backup */ SELECT s.recording AS "recording!" FROM shards s
           WHERE s.recording IS NOT NULL
             AND s.run_id IN (SELECT run_id FROM evaluations WHERE state = 'open')
           ORDER BY s.run_id, s.position"#
    )
    .fetch_all(&mut *connection)
    .await?;
    required.extend(
        recordings
            .into_iter()
            .map(|key| RequiredArtifact::Folder { key }),
    );
    let games = sqlx::query!(
        r#"/* backup */ SELECT a.recording AS "key!", a.game_blake3 AS "game!", a.home_blake3 AS "home!", a.away_blake3 AS "away!"
           FROM games g JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt
           WHERE a.recording IS NOT NULL ORDER BY g.game_no"#
    )
    .fetch_all(connection)
    .await?;
    required.extend(games.into_iter().flat_map(|row| {
        [
            ("game", row.game),
            ("side-1", row.home),
            ("side-2", row.away),
        ]
        .map(|(name, blake3)| RequiredArtifact::File {
            key: format!("{}/{name}.zip", row.key),
            blake3: Some(blake3),
        })
    }));
    Ok(required)
}
