//! `faceoff backup`: a checked copy of a server's data folder, made while the server runs. It is complete, but for files that the data
//! folder itself lacks. An *artifact* is a stored file that the database refers to, e.g. a bundle or a dataset.

pub mod files;
pub mod manifest;

use super::{
    atomic_folder::{self, AtomicFolder, FolderOperation},
    config_file::ConfigFile,
    output::print,
    serve::ADMIN_TOKEN_FILE,
    storage::format_bytes,
};
use anyhow::{Context, bail};
use clap::Args;
use faceoff_store::{RequiredArtifact, Store, StoreError};
use files::{CopiedFile, copy_file, copy_tree};
use jiff::Timestamp;
use manifest::{ARTIFACTS, BackupFile, DATABASE, MANIFEST, Manifest, MissingFile};
use std::{
    collections::BTreeMap,
    io::Read as _,
    path::{Path, PathBuf},
};

/// Copies all data of a server into a folder: the database with the season's secret, the artifacts and the operator's
/// token. The server keeps running. The folder appears only when all is copied and checked, readable by its owner only:
/// the database is intact, and every file it refers to exists with the recorded hash. If such a file is missing or
/// damaged in the data folder itself, the copy is still made, each of these files is named, and the command ends with
/// an error. Keep the copy as secret as the server itself.
#[derive(Debug, Args)]
pub struct BackupCommand {
    /// The folder to create; an existing folder must be empty
    folder: PathBuf,
    #[command(flatten)]
    config: ConfigFile,
    /// The server's data folder; overrides server.data_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// Print a summary as JSON
    #[arg(long)]
    json: bool,
}

const BACKUP: FolderOperation = FolderOperation {
    name: "backup",
    suffix: "backing-up",
};

impl BackupCommand {
    /// Makes the backup and prints its summary.
    ///
    /// # Errors
    /// If something cannot be read or written; no backup is made. If the data folder lacks files that the database
    /// refers to; the backup then has all other files.
    pub fn run(self) -> anyhow::Result<()> {
        let data_dir = match self.data_dir {
            Some(folder) => folder,
            None => self.config.load()?.server.data_dir,
        };
        let manifest = back_up(&data_dir, &self.folder, Timestamp::now())?;
        print(self.json, &manifest.summary(&self.folder), |_| {
            let mut text = format!(
                "backed up {:?} to {}: {} files, {}",
                manifest.season,
                self.folder.display(),
                manifest.files.len(),
                format_bytes(manifest.total_bytes())
            );
            if manifest.missing.is_empty() {
                text.push_str(&format!(
                    "\nchecked: the database is intact, and all files it refers to are unchanged\n\
                    to restore it: faceoff restore {} --data-dir FOLDER",
                    self.folder.display()
                ));
            }
            text
        })?;
        if manifest.missing.is_empty() {
            return Ok(());
        }
        for missing in &manifest.missing {
            eprintln!("{missing}");
        }
        bail!(
            "the backup is made, but {} files that the database refers to are missing or damaged in {}; all other files \
            can be restored",
            manifest.missing.len(),
            data_dir.display()
        )
    }
}

/// Makes a complete backup or none.
fn back_up(data_dir: &Path, target: &Path, now: Timestamp) -> anyhow::Result<Manifest> {
    atomic_folder::check_empty(
        target,
        "each backup needs its own folder: name an empty or a new one",
    )?;
    let absolute = |path: &Path| {
        std::path::absolute(path).with_context(|| format!("looking for {}", path.display()))
    };
    if absolute(target)?.starts_with(absolute(data_dir)?) {
        bail!(
            "{} is inside the data folder: choose another place for the backup, preferably another disk",
            target.display()
        );
    }
    let new_folder = AtomicFolder::create(target, &BACKUP)?;
    let folder = new_folder.content();
    atomic_folder::create_private(&folder)?;
    let database = folder.join(DATABASE);
    // The database comes first: the server writes a file before the database refers to it, and keeps it for a day
    // after the database has stopped referring to it.
    let checked = super::block_on(async {
        match Store::copy_database(data_dir, &database).await {
            Err(StoreError::NotFound(_)) => bail!(
                "{} is not the data folder of a server: it has no {DATABASE}; name the folder with --data-dir",
                data_dir.display()
            ),
            copied => {
                copied.with_context(|| format!("copying the database of {}", data_dir.display()))?
            }
        }
        Store::check_database(&database, new_folder.scratch())
            .await
            .context("the copy of the database")
    })?;
    let mut files = BTreeMap::new();
    files.insert(DATABASE.to_owned(), files::make_private(&database)?);
    let artifacts = folder.join(ARTIFACTS);
    copy_tree(&data_dir.join(ARTIFACTS), &artifacts, ARTIFACTS, &mut files)?;
    let token = data_dir.join(ADMIN_TOKEN_FILE);
    if token.exists() {
        let file = copy_file(&token, &folder.join(ADMIN_TOKEN_FILE))?;
        files.insert(ADMIN_TOKEN_FILE.to_owned(), file);
    }
    let manifest = Manifest {
        format: manifest::FORMAT,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        schema: checked.schema,
        season: checked.season,
        made_at: now,
        missing: missing_files(&checked.needed, &files),
        files: files
            .into_iter()
            .map(|(path, file)| BackupFile {
                path,
                bytes: file.bytes,
                blake3: file.blake3,
            })
            .collect(),
    };
    let json = serde_json::to_vec_pretty(&manifest).context("writing the manifest")?;
    files::write(&folder.join(MANIFEST), &json)?;
    new_folder.commit(target, &[])?;
    Ok(manifest)
}

/// Files that the database refers to and that are missing or damaged in the data folder.
fn missing_files(
    needed: &[RequiredArtifact],
    copied: &BTreeMap<String, CopiedFile>,
) -> Vec<MissingFile> {
    let path = |key: &str| format!("{ARTIFACTS}/{key}");
    let mut missing = Vec::new();
    for item in needed {
        match item {
            RequiredArtifact::File { key, blake3 } => match (copied.get(&path(key)), blake3) {
                (None, _) => missing.push(MissingFile::Gone { path: path(key) }),
                (Some(found), Some(blake3)) if found.blake3 != *blake3 => {
                    missing.push(MissingFile::Changed {
                        path: path(key),
                        expected: blake3.clone(),
                        found: found.blake3.clone(),
                    });
                }
                (Some(_), _) => {}
            },
            RequiredArtifact::Folder { key } => {
                let prefix = format!("{}/", path(key));
                let first = copied.range(prefix.clone()..).next();
                if !first.is_some_and(|(name, _)| name.starts_with(&prefix)) {
                    missing.push(MissingFile::Gone { path: prefix });
                }
            }
        }
    }
    missing
}

/// Reads the manifest of a backup.
///
/// # Errors
/// If the folder is no backup, or a backup of a later version.
pub fn read_manifest(folder: &Path) -> anyhow::Result<Manifest> {
    let file = folder.join(MANIFEST);
    let mut text = Vec::new();
    files::open_regular(&file)
        .and_then(|mut file| file.read_to_end(&mut text))
        .with_context(|| {
            format!(
                "{} is not a backup made by `faceoff backup`: reading its {MANIFEST}",
                folder.display()
            )
        })?;
    Manifest::parse(&text).with_context(|| format!("{}", file.display()))
}
