//! `faceoff restore`: a data folder from a backup.

use super::{
    backup::{
        self, files,
        manifest::{ARTIFACTS, DATABASE, Manifest},
    },
    output::print,
    serve::claim,
    staging::{self, Kind, Staging},
    storage::bytes,
};
use anyhow::{Context as _, bail, ensure};
use clap::Args;
use faceoff_store::Store;
use jiff::Timestamp;
use serde_json::json;
use std::{
    collections::BTreeSet,
    fs::File,
    path::{Path, PathBuf},
};

/// Makes a data folder of what `faceoff backup` has copied, for `faceoff serve` to go on from: work that was under way goes on
/// from its last committed shard. Every file is held against the backup's list, and the database is checked, before the
/// folder is there.
#[derive(Debug, Args)]
pub struct RestoreCommand {
    /// What `faceoff backup` made
    folder: PathBuf,
    /// The data folder to make; one that exists must be empty
    #[arg(
        long,
        visible_alias = "data-dir",
        value_name = "FOLDER",
        required_unless_present = "check"
    )]
    data: Option<PathBuf>,
    /// Take the place of a data folder that no server uses; what is there stays beside it, under another name
    #[arg(long)]
    replace: bool,
    /// Only look whether the backup is whole
    #[arg(long, conflicts_with_all = ["data", "replace"])]
    check: bool,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

const RESTORE: Kind = Kind {
    name: "restore",
    suffix: "restoring",
};

impl RestoreCommand {
    /// Restores it, or checks it.
    ///
    /// # Errors
    /// If the backup is not whole, the folder holds something or is a running server's; nothing has changed then.
    pub fn run(self) -> anyhow::Result<()> {
        let manifest = backup::open(&self.folder)?;
        let Some(data) = self.data else {
            check(&self.folder, &manifest)?;
            for missing in &manifest.missing {
                eprintln!("the backup was made without it: {missing}");
            }
            ensure!(
                manifest.missing.is_empty(),
                "{} is as it was made, but was made without {} of what its database names",
                self.folder.display(),
                manifest.missing.len()
            );
            return print(self.json, &manifest.told(&self.folder), || {
                format!(
                    "{} is whole: {:?} as it was at {}, {} files, {}",
                    self.folder.display(),
                    manifest.season,
                    manifest.made_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                    manifest.files.len(),
                    bytes(manifest.total_bytes())
                )
            });
        };
        let replaced = restore(&self.folder, &manifest, &data, self.replace)?;
        let mut told = manifest.told(&data);
        told["replaced"] = json!(replaced);
        print(self.json, &told, || {
            let mut lines = vec![format!(
                "restored {:?} as it was at {}: {} files, {}",
                manifest.season,
                manifest.made_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                manifest.files.len(),
                bytes(manifest.total_bytes())
            )];
            let missing = manifest.missing.iter();
            lines.extend(missing.map(|one| format!("the backup was made without it: {one}")));
            if let Some(replaced) = &replaced {
                lines.push(format!(
                    "what was there is {} now; remove it when it is not needed any more",
                    replaced.display()
                ));
            }
            lines.push(format!("next: faceoff serve --data-dir {}", data.display()));
            lines.join("\n")
        })
    }
}

/// Makes the data folder; where what was there has gone.
fn restore(
    folder: &Path,
    manifest: &Manifest,
    data: &Path,
    replace: bool,
) -> anyhow::Result<Option<PathBuf>> {
    let is_empty = staging::check_empty(
        data,
        "a backup is restored into a folder of its own: name one that is empty or not there yet, or have it take this \
         one's place with --replace",
    );
    // Held to the end: whoever has it is told before anything is copied.
    let claimed = match is_empty {
        Ok(()) => None,
        Err(_) if replace => Some(claim_old(data)?),
        Err(refused) => return Err(refused),
    };
    let staging = Staging::make(data, &RESTORE)?;
    let made = staging.content();
    staging::private(&made)?;
    let mut folders = BTreeSet::from([ARTIFACTS.to_owned()]);
    for file in &manifest.files {
        let (from, to) = (folder.join(&file.path), made.join(&file.path));
        let inside = Path::new(&file.path).ancestors().skip(1);
        folders.extend(inside.filter_map(|folder| Some(folder.to_str()?.to_owned())));
        if let Some(parent) = to.parent() {
            staging::private(parent)?;
        }
        let copied = files::copy_whole(&from, &to)?;
        ensure!(
            copied.blake3 == file.blake3,
            "{} is not what was backed up: expected BLAKE3 {}, got {}",
            from.display(),
            file.blake3,
            copied.blake3
        );
    }
    check_database(&made.join(DATABASE), staging.scratch())?;
    super::block_on(async {
        let skipped = Store::skip_event_ids(&made.join(DATABASE)).await;
        skipped.context("letting the ids of events go on behind those that were given")
    })?;
    staging::private(&made.join(ARTIFACTS))?;
    let folders: Vec<&str> = folders.iter().map(String::as_str).collect();
    if claimed.is_none() {
        staging.settle(data, &folders)?;
        return Ok(None);
    }
    let aside = aside(data)?;
    staging.replace(data, &folders, &aside)?;
    Ok(Some(aside))
}

/// Claims a data folder that is to be replaced.
fn claim_old(data: &Path) -> anyhow::Result<File> {
    ensure!(
        data.join(DATABASE).exists(),
        "{} holds no {DATABASE}: --replace takes the place of a data folder, and of nothing else",
        data.display()
    );
    claim(data)
}

/// What a data folder is named that is replaced. The database goes with its log, so that none of its is left for another
/// database.
fn aside(data: &Path) -> anyhow::Result<PathBuf> {
    let Some(name) = data.file_name() else {
        bail!("{} names no folder that could be moved", data.display());
    };
    let mut name = name.to_owned();
    name.push(
        Timestamp::now()
            .strftime(".replaced-%Y%m%dT%H%M%SZ")
            .to_string(),
    );
    let aside = data.with_file_name(name);
    ensure!(!aside.exists(), "{} is in the way", aside.display());
    Ok(aside)
}

/// Holds every file against the list, and looks into the database.
fn check(folder: &Path, manifest: &Manifest) -> anyhow::Result<()> {
    for file in &manifest.files {
        let path = folder.join(&file.path);
        let found = files::hashed(&path)?;
        ensure!(
            found.blake3 == file.blake3,
            "{} is not what was backed up: expected BLAKE3 {}, got {}",
            path.display(),
            file.blake3,
            found.blake3
        );
    }
    let scratch = tempfile::tempdir().context("making a folder for a copy of the database")?;
    check_database(&folder.join(DATABASE), scratch.path())
}

fn check_database(database: &Path, scratch: &Path) -> anyhow::Result<()> {
    super::block_on(async {
        Store::check_database(database, scratch)
            .await
            .context("the backup's database")
    })?;
    Ok(())
}
