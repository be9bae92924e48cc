//! Snapshots: a copy of the database for an archive (the season in one file), made while the server runs.

use crate::{
    boxed_future,
    database::Database,
    error::{Result, StoreError},
    free_space::FreeSpace,
    health_probes::HealthProbes,
    operations::scrub_archive::scrub,
    signals::Signals,
    store::Store,
    tables::{
        archive::{self, ArchivedArtifact, ArchivedSeason, Edition},
        days, episode_summaries, evaluations, season, stages,
    },
};
use faceoff_types::RunId;
use jiff::Timestamp;
use sqlx::{
    Connection, SqliteConnection,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// The season at one instant, with the contents of one edition of the archive (the public or the organisers').
#[derive(Debug)]
pub struct DatabaseSnapshot {
    store: Store,
    file: PathBuf,
    /// Number of queued or running evaluations; in the organisers' edition, those of proposals are included. These
    /// evaluations are left out of the archive, as are their proposals and all unreleased days.
    pub open_evaluations: u32,
}

/// Episode summaries for an archive, which the season does not have yet: the public edition has no other data about episodes.
#[derive(Debug, Clone, Default)]
pub struct MissingSummaries {
    /// The current version of their format.
    pub version: u32,
    /// In JSON.
    pub json_by_run: Vec<(RunId, String)>,
}

impl Store {
    /// Copies the database as it is now into `folder`, without credentials, open jobs and the secret of a running
    /// season. The public edition also lacks users, bundles, logs, and hidden scores. `program`, the name and version of
    /// this program, is recorded in the copy. The copy gets the episode summaries that the database lacks. Takes disk space and
    /// time in proportion to the database; writers are not blocked. [`StoreError::Conflict`] if a public archive is asked for the
    /// organiser's edition, or if a result without a summary came in meanwhile.
    #[boxed_future]
    pub async fn snapshot(
        &self,
        folder: &Path,
        edition: Edition,
        program: &str,
        summaries: &MissingSummaries,
        now: Timestamp,
    ) -> Result<DatabaseSnapshot> {
        if let Some(archived) = &self.archive
            && archived.edition == Edition::Public
            && edition == Edition::Organiser
        {
            return StoreError::conflict(
                "this is a season's public archive, which has no data for organisers only: ask for the public edition",
            );
        }
        let file = folder.join("snapshot.sqlite3");
        copy(&self.database.file, &file).await?;
        let options = SqliteConnectOptions::new()
            .filename(&file)
            .create_if_missing(false)
            // rows are removed in any order; references are checked at the end
            .foreign_keys(false)
            // the file is discarded after a crash
            .journal_mode(SqliteJournalMode::Off)
            .synchronous(SqliteSynchronous::Off);
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let mut open_evaluations = evaluations::count_open(&mut connection, None).await?;
        if edition == Edition::Organiser {
            open_evaluations += evaluations::count_open_proposed(&mut connection, None).await?;
        }
        describe_archive(&mut connection, edition, program, now).await?;
        for (run, summary) in &summaries.json_by_run {
            episode_summaries::put(&mut connection, *run, summaries.version, summary).await?;
        }
        scrub(&mut connection, edition, summaries.version).await?;
        connection.close().await?;
        let database = Database::open(&file).await?;
        let archived = archive::read(&mut *database.read.acquire().await?).await?;
        let store = Self {
            database,
            signals: Arc::new(Signals::new()),
            artifacts: self.artifacts.clone(),
            free_space: Arc::new(FreeSpace::new(vec![folder.to_owned()], 0)),
            probes: Arc::new(HealthProbes::new()),
            archive: archived.map(Arc::new),
        };
        Ok(DatabaseSnapshot {
            store,
            file,
            open_evaluations,
        })
    }
}

impl DatabaseSnapshot {
    /// A store on the copy; its artifacts are those of the original.
    #[must_use]
    pub const fn store(&self) -> &Store {
        &self.store
    }

    /// Artifacts in the organiser's archive other than the datasets of evaluations.
    #[boxed_future]
    pub async fn artifacts_to_archive(&self) -> Result<Vec<ArchivedArtifact>> {
        archive::artifacts(&mut *self.store.database.read.acquire().await?).await
    }

    /// Writes the snapshot to a new file, without remains of the removed data, and deletes the copy.
    #[boxed_future]
    pub async fn finish(self, file: &Path) -> Result<()> {
        copy(&self.file, file).await?;
        self.store.close().await;
        std::fs::remove_file(&self.file)
            .map_err(|error| StoreError::artifact(self.file.display(), &error))
    }
}

/// Copies a database with everything committed, and without its unused pages.
pub(crate) async fn copy(source: &Path, target: &Path) -> Result<()> {
    let target = target
        .to_str()
        .ok_or_else(|| StoreError::Artifacts(format!("{}: not a UTF-8 path", target.display())))?;
    let options = SqliteConnectOptions::new().filename(source).read_only(true);
    let mut connection = SqliteConnection::connect_with(&options).await?;
    sqlx::query("VACUUM INTO ?")
        .bind(target)
        .execute(&mut connection)
        .await?;
    connection.close().await?;
    Ok(())
}

/// Writes the description of the archive, and the seeds of released days: they follow from the season's secret, which the
/// archive does not contain.
async fn describe_archive(
    connection: &mut SqliteConnection,
    edition: Edition,
    program: &str,
    now: Timestamp,
) -> Result<()> {
    let season = season::read(connection).await?;
    if let Some(archived) = archive::read(connection).await? {
        // An archive made from an imported archive shows the season at the same instant.
        let archived = ArchivedSeason {
            edition,
            imported_at: None,
            ..archived
        };
        return archive::put(connection, &archived).await;
    }
    let archived = ArchivedSeason {
        edition,
        made_at: now,
        program: program.to_owned(),
        commitment: season.commitment,
        imported_at: None,
    };
    archive::put(connection, &archived).await?;
    if season.closed_at.is_some() {
        return Ok(());
    }
    let stages = stages::all(connection).await?;
    for (day, _) in days::all(connection).await? {
        let stage = stages.iter().find(|stage| stage.id == day.stage_day.stage);
        if let (Some(stage), Some(_)) = (stage, day.released_at) {
            let seed = stage.seed_label(day.stage_day.date).seed(&season.secret);
            archive::put_seed(connection, day.stage_day, &seed).await?;
        }
    }
    Ok(())
}
