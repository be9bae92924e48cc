//! The season archive, made while the server is running. It contains a snapshot of the database, reduced to what its edition
//! (public or the organisers') may contain; responses of the API as files; and artifacts, which are stored files such as
//! datasets. Artifacts are read only while the archive is sent.

use faceoff_archive::{Edition, FORMAT, Manifest};
use faceoff_live::LiveState;
use faceoff_scoring::EpisodeSummary;
use faceoff_service::{
    app::{App, AppState},
    config::HttpConfig,
    free_space,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
};
use faceoff_store::{ArtifactOwner, DatabaseSnapshot, MissingSummaries};
use faceoff_types::Clock;
use files::Files;
use jiff::Timestamp;
use results::ArtifactRow;
pub(crate) use send::send;
use std::{path::PathBuf, sync::Arc};
use tempfile::TempDir;

mod day_csv;
mod events;
mod files;
mod results;
mod send;

/// Program and version that made the archive, for its manifest (the list of its files).
const PROGRAM: &str = concat!("faceoff ", env!("CARGO_PKG_VERSION"));

/// File name of the database in an archive.
const DATABASE_FILE: &str = "database.sqlite3";

/// A prepared archive, whose files are known and hashed, and only have to be sent.
pub(crate) struct PreparedArchive {
    pub(crate) manifest: Manifest,
    /// Local path of each file in the manifest, in its order.
    local_paths: Vec<PathBuf>,
    /// Folder of the files that are not artifacts. It is removed on drop; after a crash, at the server's next start.
    _folder: TempDir,
}

impl PreparedArchive {
    /// File name of the download.
    pub(crate) fn file_name(&self) -> String {
        format!(
            "{}-{}-{}.tar.zst",
            results::slug(&self.manifest.season),
            self.manifest.edition,
            self.manifest.made_at.strftime("%Y-%m-%d")
        )
    }
}

/// The edition as the store's type of the same name.
pub(crate) const fn store_edition(edition: Edition) -> faceoff_store::Edition {
    match edition {
        Edition::Public => faceoff_store::Edition::Public,
        Edition::Organiser => faceoff_store::Edition::Organiser,
    }
}

/// Collects the contents of an archive and their hashes.
///
/// # Errors
/// `StorageFull`; `Conflict` if the organiser's edition is requested from a server that shows an imported public archive.
pub(crate) async fn collect(app: &App, edition: Edition) -> Result<PreparedArchive, Problem> {
    free_space::check(app)?;
    let folder = tempfile::Builder::new()
        .prefix("archive-")
        .tempdir_in(&app.config.upload_dir)
        .map_err(free_space::write_problem)?;
    let now = app.config.clock.now();
    let summaries = match edition {
        Edition::Public => missing_summaries(app).await?,
        // The organiser's edition contains the datasets, from which the summaries can be computed.
        Edition::Organiser => MissingSummaries::default(),
    };
    let snapshot = app
        .store
        .snapshot(
            folder.path(),
            store_edition(edition),
            PROGRAM,
            &summaries,
            now,
        )
        .await?;
    let Some(archived) = snapshot.store().archived_season().cloned() else {
        return Err(Problem::internal("a snapshot has no archive metadata"));
    };
    let mut files = Files::new(folder.path());
    let season = snapshot.store().season().await?.name;
    files
        .put(
            "README.txt",
            readme(&season, edition, archived.made_at).into_bytes(),
        )
        .await?;

    let snapshot_state = snapshot_app(app, &snapshot, archived.made_at);
    let viewer = match edition {
        Edition::Public => Viewer::Visitor,
        Edition::Organiser => Viewer::Organiser,
    };
    let mut artifacts = results::collect(&snapshot_state, viewer, &mut files).await?;
    results::put_team_questions(&snapshot_state, edition, &mut files).await?;
    events::put(&snapshot_state, &mut files).await?;
    drop(snapshot_state);

    let mut left_out = Vec::new();
    if snapshot.open_evaluations > 0 {
        left_out.push(format!(
            "{} evaluations that were queued or running, with everything else of their unreleased days and of their \
             proposals",
            snapshot.open_evaluations
        ));
    }
    if edition == Edition::Organiser {
        for artifact in snapshot.artifacts_to_archive().await? {
            artifacts.push(match artifact.owner {
                ArtifactOwner::Bundle(id) => {
                    ArtifactRow::without_team("submission", id, artifact.key, artifact.blake3)
                }
                ArtifactOwner::ProposedEvaluation(id) => {
                    ArtifactRow::without_team("proposal", id, artifact.key, artifact.blake3)
                }
                ArtifactOwner::Game(id) => {
                    ArtifactRow::without_team("game", id, artifact.key, artifact.blake3)
                }
            });
        }
    }
    let database = folder.path().join(DATABASE_FILE);
    snapshot.finish(&database).await?;
    files.add(DATABASE_FILE, database).await?;
    results::add_artifacts(app, artifacts, &mut files, &mut left_out).await?;

    let (entries, local_paths) = files.into_parts();
    let manifest = Manifest {
        format: FORMAT,
        program: PROGRAM.to_owned(),
        season,
        made_at: archived.made_at,
        edition,
        left_out,
        files: entries,
    };
    // The check comes before the response begins: after that, an error could only break the response off.
    manifest.check().map_err(Problem::internal)?;
    Ok(PreparedArchive {
        manifest,
        local_paths,
        _folder: folder,
    })
}

/// The episode summaries of runs (all episodes of one agent) that have none stored: runs that have just ended, or of a season that was
/// imported without.
async fn missing_summaries(app: &App) -> Result<MissingSummaries, Problem> {
    let version = EpisodeSummary::VERSION;
    let mut json_by_run = Vec::new();
    for run in app.store.unsummarised_runs(version).await? {
        let summary = app.summaries.load_run(run).await?;
        let json = serde_json::to_string(&*summary).map_err(Problem::internal)?;
        json_by_run.push((run, json));
    }
    Ok(MissingSummaries {
        version,
        json_by_run,
    })
}

/// An application state that shows the snapshot at its time, as a server with the imported archive does.
fn snapshot_app(app: &App, snapshot: &DatabaseSnapshot, made_at: Timestamp) -> App {
    let config = HttpConfig {
        clock: Clock::new(move || made_at),
        ..app.config.clone()
    };
    let live = LiveState::default();
    Arc::new(AppState::new(snapshot.store().clone(), live, config))
}

fn readme(season: &str, edition: Edition, made_at: Timestamp) -> String {
    let contents = match edition {
        Edition::Public => "the public edition, with everything that visitors can see and download",
        Edition::Organiser => {
            "the organiser's edition: everything except tokens, passwords and unfinished evaluations. Keep it as secret as \
             the server"
        }
    };
    format!(
        "Archive of the season {season:?} as of {}; {contents}.\n\
         \n\
         manifest.json          every file with its length and its BLAKE3 hash\n\
         results/               stages, boards and days as JSON and CSV, tournaments, teams, announcements, questions\n\
         events.jsonl           the event log, oldest first\n\
         datasets.csv           team and visibility of each recording\n\
         artifacts/datasets/    the recordings; `faceoff verify FILE` replays them\n\
         database.sqlite3       for `faceoff import`, which shows the season on another server\n\
         \n\
         docs/archive.md of Faceoff describes the format.\n",
        made_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    )
}

/// The problem of a second archive while one is made or sent.
pub(crate) fn archive_busy() -> Problem {
    Problem::new(
        ProblemKind::Busy,
        "an archive is being made or downloaded, and only one can be at a time; try again in a minute",
    )
    .retry_after(60)
}
