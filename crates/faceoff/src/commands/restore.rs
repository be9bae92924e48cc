//! `faceoff restore`: creates a data folder from a backup. An *artifact* is a stored file that the database refers to.

use super::{
    atomic_folder::{self, AtomicFolder, FolderOperation},
    backup::{
        self,
        files::{self, CopiedFile},
        manifest::{ARTIFACTS, BackupFile, DATABASE, Manifest},
    },
    output::{exact_time_text, print},
    serve::lock,
    storage::format_bytes,
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

/// Creates a data folder from a backup of `faceoff backup`, with which `faceoff serve` continues: unfinished
/// evaluations continue after their last committed shard. All files are compared with the backup's list and the
/// database is checked before the folder is created.
#[derive(Debug, Args)]
pub struct RestoreCommand {
    /// The backup, made by `faceoff backup`
    folder: PathBuf,
    /// The data folder to create; an existing folder must be empty
    #[arg(
        long,
        visible_alias = "data-dir",
        value_name = "FOLDER",
        required_unless_present = "check"
    )]
    data: Option<PathBuf>,
    /// Replace a data folder that no server uses; the old one is kept beside it under another name
    #[arg(long)]
    replace: bool,
    /// Only check whether the backup is intact
    #[arg(long, conflicts_with_all = ["data", "replace"])]
    check: bool,
    /// Print a summary as JSON
    #[arg(long)]
    json: bool,
}

const RESTORE: FolderOperation = FolderOperation {
    name: "restore",
    suffix: "restoring",
};

impl RestoreCommand {
    /// Restores or checks the backup.
    ///
    /// # Errors
    /// If the backup is damaged, or the folder is not empty or in use by a server. Nothing is changed then.
    pub fn run(self) -> anyhow::Result<()> {
        let manifest = backup::read_manifest(&self.folder)?;
        let Some(data) = self.data else {
            check(&self.folder, &manifest)?;
            for missing in &manifest.missing {
                eprintln!("missing in the backup: {missing}");
            }
            ensure!(
                manifest.missing.is_empty(),
                "{} is intact, but lacks {} files that its database refers to",
                self.folder.display(),
                manifest.missing.len()
            );
            return print(self.json, &manifest.summary(&self.folder), |_| {
                format!(
                    "{} is intact: {:?} of {}, {} files, {}",
                    self.folder.display(),
                    manifest.season,
                    exact_time_text(manifest.made_at),
                    manifest.files.len(),
                    format_bytes(manifest.total_bytes())
                )
            });
        };
        let replaced = restore(&self.folder, &manifest, &data, self.replace)?;
        let mut summary = manifest.summary(&data);
        summary["replaced"] = json!(replaced);
        print(self.json, &summary, |_| {
            let mut lines = vec![format!(
                "restored {:?} of {}: {} files, {}",
                manifest.season,
                exact_time_text(manifest.made_at),
                manifest.files.len(),
                format_bytes(manifest.total_bytes())
            )];
            let missing = manifest.missing.iter();
            lines.extend(missing.map(|file| format!("missing in the backup: {file}")));
            if let Some(replaced) = &replaced {
                lines.push(format!(
                    "the old data folder is now {}; remove it when it is no longer needed",
                    replaced.display()
                ));
            }
            lines.push(format!("next: faceoff serve --data-dir {}", data.display()));
            lines.join("\n")
        })
    }
}

/// Creates the data folder. Returns the new path of a replaced one.
fn restore(
    folder: &Path,
    manifest: &Manifest,
    data: &Path,
    replace: bool,
) -> anyhow::Result<Option<PathBuf>> {
    let is_empty = atomic_folder::check_empty(
        data,
        "a backup is restored into its own folder: name an empty or a new one, or replace this one \
        with --replace",
    );
    // A folder that is replaced stays locked until the end. A server that uses it is noticed before anything is copied.
    let lock = match is_empty {
        Ok(()) => None,
        Err(_) if replace => Some(lock_replaced(data)?),
        Err(error) => return Err(error),
    };
    let new_folder = AtomicFolder::create(data, &RESTORE)?;
    let content = new_folder.content();
    atomic_folder::create_private(&content)?;
    let mut folders = BTreeSet::from([ARTIFACTS.to_owned()]);
    for file in &manifest.files {
        let (from, to) = (folder.join(&file.path), content.join(&file.path));
        let parents = Path::new(&file.path).ancestors().skip(1);
        folders.extend(parents.filter_map(|folder| Some(folder.to_str()?.to_owned())));
        if let Some(parent) = to.parent() {
            atomic_folder::create_private(parent)?;
        }
        let copied = files::copy_file(&from, &to)?;
        check_unchanged(&from, file, &copied)?;
    }
    check_database(&content.join(DATABASE), new_folder.scratch())?;
    super::block_on(async {
        let skipped = Store::skip_event_ids(&content.join(DATABASE)).await;
        skipped.context("reserving the event ids that the old server may have used")
    })?;
    atomic_folder::create_private(&content.join(ARTIFACTS))?;
    let folders: Vec<&str> = folders.iter().map(String::as_str).collect();
    if lock.is_none() {
        new_folder.commit(data, &folders)?;
        return Ok(None);
    }
    let old = replaced_path(data)?;
    new_folder.replace(data, &folders, &old)?;
    Ok(Some(old))
}

/// Locks a data folder that is to be replaced.
fn lock_replaced(data: &Path) -> anyhow::Result<File> {
    ensure!(
        data.join(DATABASE).exists(),
        "{} has no {DATABASE}: --replace only replaces data folders",
        data.display()
    );
    lock(data)
}

/// The new path of a data folder that is replaced. The whole folder is moved, so that the new database does not find
/// the write-ahead log of the old one.
fn replaced_path(data: &Path) -> anyhow::Result<PathBuf> {
    let Some(name) = data.file_name() else {
        bail!("{} is not a folder that can be moved", data.display());
    };
    let mut name = name.to_owned();
    name.push(
        Timestamp::now()
            .strftime(".replaced-%Y%m%dT%H%M%SZ")
            .to_string(),
    );
    let path = data.with_file_name(name);
    ensure!(!path.exists(), "{} already exists", path.display());
    Ok(path)
}

/// Compares every file with the manifest and checks the database.
fn check(folder: &Path, manifest: &Manifest) -> anyhow::Result<()> {
    for file in &manifest.files {
        let path = folder.join(&file.path);
        let found = files::hash_file(&path)?;
        check_unchanged(&path, file, &found)?;
    }
    let scratch = tempfile::tempdir().context("creating a folder for a copy of the database")?;
    check_database(&folder.join(DATABASE), scratch.path())
}

fn check_unchanged(path: &Path, listed: &BackupFile, found: &CopiedFile) -> anyhow::Result<()> {
    ensure!(
        found.blake3 == listed.blake3,
        "{} has changed since the backup: expected BLAKE3 {}, got {}",
        path.display(),
        listed.blake3,
        found.blake3
    );
    Ok(())
}

fn check_database(database: &Path, scratch: &Path) -> anyhow::Result<()> {
    super::block_on(async {
        Store::check_database(database, scratch)
            .await
            .context("the backup's database")
    })?;
    Ok(())
}
