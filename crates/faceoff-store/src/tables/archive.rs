//! Tables in the database of an archive (a season in one file): its description and the seeds of its days.

use crate::{
    column::{Bytes32, Instant},
    error::Result,
};
use faceoff_types::{EvaluationId, GameId, Seed, StageDay, StageId, SubmissionId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};
use std::{collections::BTreeMap, fmt, str::FromStr};

/// The audience of an archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edition {
    /// For everyone: everything that is visible without a token.
    Public,
    /// For organisers: everything except secrets.
    Organiser,
}

impl fmt::Display for Edition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Public => "public",
            Self::Organiser => "organiser",
        })
    }
}

/// A text that is not an edition.
#[derive(Debug, thiserror::Error)]
#[error("no edition of an archive: expected “public” or “organiser”")]
pub struct ParseEditionError;

impl FromStr for Edition {
    type Err = ParseEditionError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        match s {
            "public" => Ok(Self::Public),
            "organiser" => Ok(Self::Organiser),
            _ => Err(ParseEditionError),
        }
    }
}

faceoff_types::sqlite_text!(Edition);

/// Description of an archive; a season that was imported from one is read-only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArchivedSeason {
    /// Which part of the season the archive contains.
    pub edition: Edition,
    /// When the archive was made; it shows the season at this time.
    pub made_at: Timestamp,
    /// The program that made the archive, with its version.
    pub program: String,
    /// BLAKE3 of the season's secret, 64 hexadecimal digits.
    pub commitment: String,
    /// When it was imported into this data folder; `None` in the archive itself.
    pub imported_at: Option<Timestamp>,
}

/// Reads the description; `None` if the database is not that of an archive.
pub(crate) async fn read(connection: &mut SqliteConnection) -> Result<Option<ArchivedSeason>> {
    let row = sqlx::query!(
        "SELECT edition, made_at, program, commitment, imported_at
         FROM archived"
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(|row| ArchivedSeason {
        edition: row.edition,
        made_at: row.made_at.0,
        program: row.program,
        commitment: row.commitment,
        imported_at: row.imported_at.map(|at| at.0),
    }))
}

/// Marks the database as that of an archive.
pub(crate) async fn put(
    connection: &mut SqliteConnection,
    archived: &ArchivedSeason,
) -> Result<()> {
    sqlx::query!(
        "INSERT OR REPLACE INTO archived (id, edition, made_at, program, commitment, imported_at)
         VALUES (1, ?, ?, ?, ?, ?)",
        archived.edition,
        Instant(archived.made_at),
        archived.program,
        archived.commitment,
        archived.imported_at.map(Instant)
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The public seeds of days, in an archive without the season's secret.
pub(crate) async fn seeds(connection: &mut SqliteConnection) -> Result<BTreeMap<StageDay, Seed>> {
    let rows = sqlx::query!(
        "SELECT stage_id AS stage, day, seed
         FROM archived_seeds"
    )
    .fetch_all(connection)
    .await?;
    let stage_day = |stage: StageId, day: Text<Date>| StageDay { stage, date: day.0 };
    Ok(rows
        .into_iter()
        .map(|row| (stage_day(row.stage, row.day), Seed::from_bytes(row.seed.0)))
        .collect())
}

pub(crate) async fn put_seed(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    seed: &Seed,
) -> Result<()> {
    let (stage, day, seed) = (
        stage_day.stage,
        Text(stage_day.date),
        Bytes32(*seed.as_bytes()),
    );
    sqlx::query!(
        "INSERT OR REPLACE INTO archived_seeds (stage_id, day, seed) VALUES (?, ?, ?)",
        stage,
        day,
        seed
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// An artifact that an organiser's archive includes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArchivedArtifact {
    pub key: String,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
    pub owner: ArtifactOwner,
}

/// The submission, evaluation or game that an artifact belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArtifactOwner {
    /// A submission's bundle.
    Bundle(SubmissionId),
    /// The dataset of an evaluation of a trial or a proposal.
    ProposedEvaluation(EvaluationId),
    /// A recording of a game: complete or of one side.
    Game(GameId),
}

/// All artifacts of an organiser's archive, except the datasets of evaluations.
pub(crate) async fn artifacts(connection: &mut SqliteConnection) -> Result<Vec<ArchivedArtifact>> {
    let bundles = sqlx::query!(
        "/* archive */ SELECT id, bundle_key, bundle_blake3 FROM submissions
         WHERE bundle_removed_at IS NULL
           AND (state = 'valid'
                OR team_id IN (SELECT id FROM teams WHERE disqualified_at IS NOT NULL OR retired_by_organiser = 1))
         ORDER BY created_at, id"
    )
    .fetch_all(&mut *connection)
    .await?;
    let datasets = sqlx::query!(
        r#"SELECT id, dataset AS "dataset!", dataset_blake3 AS "dataset_blake3!"
           FROM evaluations WHERE proposal_id IS NOT NULL AND purpose <> 'counting'
             AND dataset IS NOT NULL AND dataset_removed_at IS NULL
             AND proposal_id NOT IN (SELECT id FROM proposals WHERE outcome = 'dropped') ORDER BY created_at, id"#
    )
    .fetch_all(&mut *connection)
    .await?;
    let games = sqlx::query!(
        r#"SELECT g.id, a.recording AS "key!", a.game_blake3 AS "game!", a.home_blake3 AS "home!",
                  a.away_blake3 AS "away!"
           FROM games g JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt
           WHERE a.recording IS NOT NULL ORDER BY g.game_no"#
    )
    .fetch_all(connection)
    .await?;
    let games = games.into_iter().flat_map(|row| {
        let files = [
            ("game", row.game),
            ("side-1", row.home),
            ("side-2", row.away),
        ];
        files.map(|(name, blake3)| ArchivedArtifact {
            key: format!("{}/{name}.zip", row.key),
            blake3,
            owner: ArtifactOwner::Game(row.id),
        })
    });
    let bundles = bundles.into_iter().map(|row| ArchivedArtifact {
        key: row.bundle_key,
        blake3: row.bundle_blake3,
        owner: ArtifactOwner::Bundle(row.id),
    });
    let datasets = datasets.into_iter().map(|row| ArchivedArtifact {
        key: row.dataset,
        blake3: row.dataset_blake3,
        owner: ArtifactOwner::ProposedEvaluation(row.id),
    });
    Ok(bundles.chain(datasets).chain(games).collect())
}
