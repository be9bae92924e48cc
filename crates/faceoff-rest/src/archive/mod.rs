//! The archive of a season, made while the server goes on: a snapshot of the database without what the edition does not
//! hold, what API and pages show of it as files, and the artifacts, which are read when their turn comes.

use faceoff_archive::{Edition, FORMAT, Manifest};
use faceoff_scoring::EpisodeSummary;
use faceoff_service::{
    app::{App, AppState},
    config::HttpConfig,
    problem::{Problem, ProblemKind},
    room,
    viewer::Viewer,
};
use faceoff_store::{KeptOf, Snapshot};
use faceoff_types::Clock;
use files::Files;
use jiff::Timestamp;
use results::Recorded;
pub(crate) use send::send;
use std::{path::PathBuf, sync::Arc};
use tempfile::TempDir;

mod day_csv;
mod events;
mod files;
mod results;
mod send;

/// Who made it, as manifests tell.
const PROGRAM: &str = concat!("faceoff ", env!("CARGO_PKG_VERSION"));

/// The database's file in an archive.
const DATABASE: &str = "database.sqlite3";

/// An archive that only has to be written.
pub(crate) struct Prepared {
    pub(crate) manifest: Manifest,
    /// Of each file of the manifest, in its order, where it lies now.
    places: Vec<PathBuf>,
    /// Of those that are not artifacts; removed with it, and after a kill with all uploads at the next start.
    _folder: TempDir,
}

impl Prepared {
    /// What a download is called.
    pub(crate) fn file_name(&self) -> String {
        format!(
            "{}-{}-{}.tar.zst",
            results::plain(&self.manifest.season),
            self.manifest.edition,
            self.manifest.made_at.strftime("%Y-%m-%d")
        )
    }
}

/// As the store calls it.
pub(crate) const fn of_store(edition: Edition) -> faceoff_store::Edition {
    match edition {
        Edition::Public => faceoff_store::Edition::Public,
        Edition::Organiser => faceoff_store::Edition::Organiser,
    }
}

/// Gathers what an archive holds, and the hashes of all of it.
///
/// # Errors
/// `StorageFull`; `Conflict` where a public archive is to become an organiser's.
pub(crate) async fn prepare(app: &App, edition: Edition) -> Result<Prepared, Problem> {
    room::check(app)?;
    let folder = tempfile::Builder::new()
        .prefix("archive-")
        .tempdir_in(&app.config.upload_dir)
        .map_err(room::unwritten)?;
    let now = app.config.clock.now();
    if edition == Edition::Public {
        sum_up(app).await?;
    }
    let snapshot = app
        .store
        .snapshot(folder.path(), of_store(edition), PROGRAM, now)
        .await?;
    let Some(archived) = snapshot.store().archived().cloned() else {
        return Err(Problem::internal("a snapshot does not say what it is"));
    };
    let mut files = Files::new(folder.path());
    let season = snapshot.store().season().await?.name;
    files
        .put(
            "README.txt",
            readme(&season, edition, archived.made_at).into_bytes(),
        )
        .await?;

    let of = still(app, &snapshot, archived.made_at);
    let viewer = match edition {
        Edition::Public => Viewer::Anybody,
        Edition::Organiser => Viewer::Organiser,
    };
    let mut recorded = results::gather(&of, viewer, &mut files).await?;
    results::put_questions(&of, edition, &mut files).await?;
    events::put(&of, &mut files).await?;
    drop(of);

    let mut left_out = Vec::new();
    if snapshot.under_way > 0 {
        left_out.push(format!(
            "{} evaluations that were queued or running, and all else of what they belong to: of a day that was not \
             released, or of a proposal",
            snapshot.under_way
        ));
    }
    if edition == Edition::Organiser {
        for kept in snapshot.kept_artifacts().await? {
            recorded.push(match kept.of {
                KeptOf::Bundle(id) => Recorded::beside("submission", id, kept.key, kept.blake3),
                KeptOf::Draft(id) => Recorded::beside("proposal", id, kept.key, kept.blake3),
                KeptOf::Game(id) => Recorded::beside("game", id, kept.key, kept.blake3),
            });
        }
    }
    let database = folder.path().join(DATABASE);
    snapshot.finish(&database).await?;
    files.add(DATABASE, database).await?;
    results::add_artifacts(app, recorded, &mut files, &mut left_out).await?;

    let (entries, places) = files.into_parts();
    let manifest = Manifest {
        format: FORMAT,
        program: PROGRAM.to_owned(),
        season,
        made_at: archived.made_at,
        edition,
        left_out,
        files: entries,
    };
    // Before the answer has begun: afterwards it could only break off.
    manifest.check().map_err(Problem::internal)?;
    Ok(Prepared {
        manifest,
        places,
        _folder: folder,
    })
}

/// Keeps what the episodes of all results come to: the public edition has nothing else of them.
async fn sum_up(app: &App) -> Result<(), Problem> {
    for run in app.store.unsummed_runs(EpisodeSummary::VERSION).await? {
        app.summaries.of_run(run).await?;
    }
    Ok(())
}

/// A site that shows the snapshot at its moment, as a server that takes the archive in will.
fn still(app: &App, snapshot: &Snapshot, made_at: Timestamp) -> App {
    let config = HttpConfig {
        clock: Clock::new(move || made_at),
        ..app.config.clone()
    };
    Arc::new(AppState::new(snapshot.store().clone(), config))
}

fn readme(season: &str, edition: Edition, made_at: Timestamp) -> String {
    let whose = match edition {
        Edition::Public => "what everybody may know and have of it",
        Edition::Organiser => {
            "the organiser's: all of it but keys, passwords and what was under way. Keep it as secret as the server"
        }
    };
    format!(
        "The archive of the season {season:?} as it was at {}; {whose}.\n\
         \n\
         manifest.json          every file with its length and its BLAKE3 hash\n\
         results/               stages, boards and days as JSON and CSV, tournaments, teams, announcements, questions\n\
         events.jsonl           what happened, in its order\n\
         datasets.csv           whose the recordings are, and which of them are public\n\
         artifacts/datasets/    the recordings; `faceoff verify FILE` plays them again\n\
         database.sqlite3       for `faceoff import`, which shows the season on another server\n\
         \n\
         docs/archive.md of Faceoff describes the format.\n",
        made_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    )
}

/// Refuses a second archive while one is made or sent.
pub(crate) fn one_at_a_time() -> Problem {
    Problem::new(
        ProblemKind::Busy,
        "an archive is being made or downloaded, and there is one at a time: try again when that is over",
    )
    .retry_after(60)
}
