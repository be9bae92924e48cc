//! A copy of the database for an archive, while the server goes on.

use crate::{
    boxed,
    database::Database,
    error::{Result, StoreError},
    live::LiveGames,
    operations::scrub::scrub,
    pulse::Pulse,
    room::Room,
    signals::Signals,
    store::Store,
    tables::{
        archived::{self, Archived, Edition, KeptArtifact},
        days, drafts, evaluations, season, stages,
    },
    workers::Workers,
};
use jiff::Timestamp;
use sqlx::{
    Connection, SqliteConnection,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// The season at one moment, as an archive of one edition shows it.
#[derive(Debug)]
pub struct Snapshot {
    store: Store,
    file: PathBuf,
    /// Evaluations, of days and for the organiser of proposals, that were queued or running: they are not in it, nor are their proposals,
    /// and of a day that is not released nothing is.
    pub under_way: u32,
}

impl Store {
    /// Copies the database as it is now into `folder`, without what the edition does not hold: keys and passwords,
    /// what is under way, the secret of a season that runs; for everybody also people, submissions, logs, and scores
    /// that are hidden. `program` is noted in it. Takes room and time in proportion to the database; writers go on.
    /// [`StoreError::Conflict`] where an archive that is public is to become an organiser's.
    #[boxed]
    pub async fn snapshot(
        &self,
        folder: &Path,
        edition: Edition,
        program: &str,
        now: Timestamp,
    ) -> Result<Snapshot> {
        if let Some(archived) = &self.archived
            && archived.edition == Edition::Public
            && edition == Edition::Organiser
        {
            return Err(StoreError::Conflict(
                "this is a season's public archive, which has nothing for the organiser alone: ask for the public one"
                    .into(),
            ));
        }
        let file = folder.join("snapshot.sqlite3");
        copy(&self.database.file, &file).await?;
        let options = SqliteConnectOptions::new()
            .filename(&file)
            .create_if_missing(false)
            // while rows go in whatever order; looked at when all are gone
            .foreign_keys(false)
            // after a kill the file is thrown away
            .journal_mode(SqliteJournalMode::Off)
            .synchronous(SqliteSynchronous::Off);
        let mut connection = SqliteConnection::connect_with(&options).await?;
        let mut under_way = evaluations::count_open(&mut connection, None).await?;
        if edition == Edition::Organiser {
            under_way += drafts::count_open(&mut connection, None).await?;
        }
        mark(&mut connection, edition, program, now).await?;
        scrub(&mut connection, edition).await?;
        connection.close().await?;
        let database = Database::open(&file).await?;
        let archived = archived::read(&mut *database.read.acquire().await?).await?;
        let store = Self {
            database,
            signals: Arc::new(Signals::new()),
            artifacts: self.artifacts.clone(),
            room: Arc::new(Room::new(vec![folder.to_owned()], 0)),
            pulse: Arc::new(Pulse::new()),
            live: LiveGames::default(),
            workers: Workers::default(),
            archived: archived.map(Arc::new),
        };
        Ok(Snapshot {
            store,
            file,
            under_way,
        })
    }
}

impl Snapshot {
    /// To be read as any other; its artifacts are the original's.
    #[must_use]
    pub const fn store(&self) -> &Store {
        &self.store
    }

    /// What the organiser's archive holds beside the datasets of evaluations.
    #[boxed]
    pub async fn kept_artifacts(&self) -> Result<Vec<KeptArtifact>> {
        archived::kept_artifacts(&mut *self.store.database.read.acquire().await?).await
    }

    /// Writes it to a new file, in which nothing is left of what was taken out, and removes the copy.
    #[boxed]
    pub async fn finish(self, file: &Path) -> Result<()> {
        copy(&self.file, file).await?;
        self.store.close().await;
        std::fs::remove_file(&self.file)
            .map_err(|error| StoreError::artifact(self.file.display(), &error))
    }
}

/// Copies a database with all that is committed, and without its unused pages.
pub(crate) async fn copy(from: &Path, to: &Path) -> Result<()> {
    let to = to
        .to_str()
        .ok_or_else(|| StoreError::Artifacts(format!("{}: not a UTF-8 path", to.display())))?;
    let options = SqliteConnectOptions::new().filename(from).read_only(true);
    let mut connection = SqliteConnection::connect_with(&options).await?;
    sqlx::query("VACUUM INTO ?")
        .bind(to)
        .execute(&mut connection)
        .await?;
    connection.close().await?;
    Ok(())
}

/// Has the copy say what it is, and keep what follows from a secret that it will not hold.
async fn mark(
    connection: &mut SqliteConnection,
    edition: Edition,
    program: &str,
    now: Timestamp,
) -> Result<()> {
    let season = season::read(connection).await?;
    if let Some(archived) = archived::read(connection).await? {
        // An archive of an archive shows the same moment.
        let archived = Archived {
            edition,
            imported_at: None,
            ..archived
        };
        return archived::put(connection, &archived).await;
    }
    let archived = Archived {
        edition,
        made_at: now,
        program: program.to_owned(),
        commitment: season.commitment,
        imported_at: None,
    };
    archived::put(connection, &archived).await?;
    if season.closed_at.is_some() {
        return Ok(());
    }
    let stages = stages::all(connection).await?;
    for (day, _) in days::all(connection).await? {
        let stage = stages.iter().find(|stage| stage.id == day.of.stage);
        if let (Some(stage), Some(_)) = (stage, day.released_at) {
            let seed = stage.seed_label(day.of.date).seed(&season.secret);
            archived::put_seed(connection, day.of, &seed).await?;
        }
    }
    Ok(())
}
