//! `faceoff import`: unpacks the archive of a season into a data folder that `faceoff serve` shows read-only. An archive is in an
//! *edition*, for the public or for organisers.

use super::{
    atomic_folder::{self, AtomicFolder, FolderOperation, create_private},
    output::{exact_time_text, print},
};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_archive::{MANIFEST_NAME, Manifest, unpack};
use faceoff_store::Store;
use jiff::Timestamp;
use serde_json::json;
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

/// File name of the database in an archive.
const ARCHIVE_DATABASE: &str = "database.sqlite3";
/// File name of the database in a data folder.
const DATABASE: &str = "faceoff.sqlite3";
/// Name of the folder of artifacts (files that the database refers to), in an archive and in a data folder.
const ARTIFACTS: &str = "artifacts";
/// Name of the folder, in a data folder, for all other files of the archive.
const OTHER_FILES: &str = "archive";

const IMPORT: FolderOperation = FolderOperation {
    name: "import",
    suffix: "importing",
};

/// Unpacks the archive of a season into a new data folder, which `faceoff serve --data-dir FOLDER` shows
/// read-only. The archive is not trusted: its files are compared with its manifest and its database is checked
/// before the folder is created.
#[derive(Debug, Args)]
pub struct ImportCommand {
    /// The archive, written by `faceoff admin export`
    archive: PathBuf,
    /// The data folder to create; an existing folder must be empty
    #[arg(long, visible_alias = "data-dir", value_name = "FOLDER")]
    data: PathBuf,
    /// Print a summary as JSON
    #[arg(long)]
    json: bool,
}

impl ImportCommand {
    /// Imports the archive.
    ///
    /// # Errors
    /// If the folder is not empty, or the archive is refused. Nothing is left in either case.
    pub fn run(self) -> anyhow::Result<()> {
        let manifest = import(&self.archive, &self.data, Timestamp::now())?;
        let summary = json!({
            "folder": self.data,
            "season": manifest.season,
            "edition": manifest.edition.to_string(),
            "made_at": manifest.made_at,
            "files": manifest.files.len(),
            "bytes": manifest.total_bytes(),
            "left_out": manifest.left_out,
        });
        print(self.json, &summary, |_| {
            let mut lines = vec![format!(
                "imported the {} archive of {:?} of {}: {} files of {} bytes",
                manifest.edition,
                manifest.season,
                exact_time_text(manifest.made_at),
                manifest.files.len(),
                manifest.total_bytes()
            )];
            let left_out = manifest.left_out.iter();
            lines.extend(left_out.map(|part| format!("the archive was made without {part}")));
            lines.push(format!(
                "next: `faceoff serve --data-dir {}` shows it read-only",
                self.data.display()
            ));
            lines.join("\n")
        })
    }
}

/// Creates the complete data folder `data` of an archive, or nothing.
///
/// # Errors
/// As [`ImportCommand::run`].
pub fn import(archive: &Path, data: &Path, now: Timestamp) -> anyhow::Result<Manifest> {
    atomic_folder::check_empty(
        data,
        "an archive is imported into its own folder: name an empty or a new one",
    )?;
    let new_folder = AtomicFolder::create(data, &IMPORT)?;
    let folder = new_folder.content();
    let unpacked = folder.join(OTHER_FILES);
    for folder in [&folder, &unpacked] {
        create_private(folder)?;
    }
    let context = || format!("{} is not imported", archive.display());
    let manifest = unpack(archive, &unpacked).with_context(context)?;
    let (from, to) = (unpacked.join(ARCHIVE_DATABASE), folder.join(DATABASE));
    match fs::rename(&from, &to) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            bail!("{}: it contains no {ARCHIVE_DATABASE}", context())
        }
        result => result.with_context(|| format!("naming {}", to.display()))?,
    }
    let (from, to) = (unpacked.join(ARTIFACTS), folder.join(ARTIFACTS));
    match fs::rename(&from, &to) {
        // An archive without this folder is of a season without artifacts.
        Err(error) if error.kind() == ErrorKind::NotFound => create_private(&to)?,
        result => result.with_context(|| format!("naming {}", to.display()))?,
    }
    let archived =
        super::block_on(async { Store::import(&folder, now).await.with_context(context) })?;
    if archived.edition.to_string() != manifest.edition.to_string()
        || archived.made_at.as_millisecond() != manifest.made_at.as_millisecond()
    {
        bail!(
            "{}: its manifest is of the {} edition of {}, its database of the {} edition of {}",
            context(),
            manifest.edition,
            manifest.made_at,
            archived.edition,
            archived.made_at
        );
    }
    // The manifest remains as a record of what was imported.
    let json = serde_json::to_vec_pretty(&manifest).context("writing the manifest")?;
    let path = unpacked.join(MANIFEST_NAME);
    fs::write(&path, json).with_context(|| format!("writing {}", path.display()))?;
    new_folder.commit(data, &[OTHER_FILES, ARTIFACTS])?;
    Ok(manifest)
}
