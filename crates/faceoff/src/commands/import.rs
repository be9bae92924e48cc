//! `faceoff import`: takes the archive of a season in, for `faceoff serve` to show it.

use super::{
    output::print,
    staging::{self, Kind, Staging, private},
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

/// The database's file in an archive, and in a data folder.
const DATABASE: (&str, &str) = ("database.sqlite3", "faceoff.sqlite3");
/// The artifacts, in both.
const ARTIFACTS: &str = "artifacts";
/// Where everything else of the archive stays.
const REST: &str = "archive";

const IMPORT: Kind = Kind {
    name: "import",
    suffix: "importing",
};

/// Unpacks the archive of a season into a new data folder, from which `faceoff serve --data-dir FOLDER` shows it
/// read-only. Nothing of the archive is trusted: it is held against its manifest, and its database is checked, before
/// the folder is there.
#[derive(Debug, Args)]
pub struct ImportCommand {
    /// What `faceoff admin export` wrote
    archive: PathBuf,
    /// The data folder to make; one that exists must be empty
    #[arg(long, visible_alias = "data-dir", value_name = "FOLDER")]
    data: PathBuf,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

impl ImportCommand {
    /// Imports it.
    ///
    /// # Errors
    /// If the folder holds something, or the archive is refused; nothing is left of it then.
    pub fn run(self) -> anyhow::Result<()> {
        let manifest = import(&self.archive, &self.data, Timestamp::now())?;
        let told = json!({
            "folder": self.data,
            "season": manifest.season,
            "edition": manifest.edition.to_string(),
            "made_at": manifest.made_at,
            "files": manifest.files.len(),
            "bytes": manifest.total_bytes(),
            "left_out": manifest.left_out,
        });
        print(self.json, &told, || {
            let mut lines = vec![format!(
                "imported the {} archive of {:?} as it was at {}: {} files of {} bytes",
                manifest.edition,
                manifest.season,
                manifest.made_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                manifest.files.len(),
                manifest.total_bytes()
            )];
            let left_out = manifest.left_out.iter();
            lines.extend(left_out.map(|what| format!("the archive was made without {what}")));
            lines.push(format!(
                "next: `faceoff serve --data-dir {}` shows it, read-only",
                self.data.display()
            ));
            lines.join("\n")
        })
    }
}

/// Makes the data folder `data` of an archive: all of it or nothing.
///
/// # Errors
/// As [`ImportCommand::run`].
pub fn import(archive: &Path, data: &Path, now: Timestamp) -> anyhow::Result<Manifest> {
    staging::check_empty(
        data,
        "an archive is imported into a folder of its own: name one that is empty or not there yet",
    )?;
    let staging = Staging::make(data, &IMPORT)?;
    let folder = staging.content();
    let rest = folder.join(REST);
    for folder in [&folder, &rest] {
        private(folder)?;
    }
    let refused = || format!("{} is not imported", archive.display());
    let manifest = unpack(archive, &rest).with_context(refused)?;
    let (from, to) = (rest.join(DATABASE.0), folder.join(DATABASE.1));
    match fs::rename(&from, &to) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            bail!("{}: there is no {} in it", refused(), DATABASE.0)
        }
        moved => moved.with_context(|| format!("naming {}", to.display()))?,
    }
    let (from, to) = (rest.join(ARTIFACTS), folder.join(ARTIFACTS));
    match fs::rename(&from, &to) {
        // a season without datasets
        Err(error) if error.kind() == ErrorKind::NotFound => private(&to)?,
        moved => moved.with_context(|| format!("naming {}", to.display()))?,
    }
    let archived =
        super::block_on(async { Store::import(&folder, now).await.with_context(refused) })?;
    if archived.edition.to_string() != manifest.edition.to_string()
        || archived.made_at.as_millisecond() != manifest.made_at.as_millisecond()
    {
        bail!(
            "{}: its manifest tells of the {} edition of {}, its database of the {} one of {}",
            refused(),
            manifest.edition,
            manifest.made_at,
            archived.edition,
            archived.made_at
        );
    }
    // For whoever asks later what was taken in.
    let json = serde_json::to_vec_pretty(&manifest).context("writing the manifest")?;
    let kept = rest.join(MANIFEST_NAME);
    fs::write(&kept, json).with_context(|| format!("writing {}", kept.display()))?;
    staging.settle(data, &[REST, ARTIFACTS])?;
    Ok(manifest)
}
