//! `faceoff backup`: a copy of a server's data folder, whole and checked, while the server goes on.

pub mod files;
pub mod manifest;

use super::{
    output::print,
    serve::ADMIN_TOKEN_FILE,
    staging::{self, Kind, Staging},
    storage::bytes,
};
use crate::config::Config;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_store::{Needed, Store, StoreError};
use files::{Copied, copy_tree, copy_whole};
use jiff::Timestamp;
use manifest::{ARTIFACTS, DATABASE, MANIFEST, Manifest, Missing, Part};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// Copies everything that a server knows into a folder: the database with the season's secret, the artifacts, and the
/// host's token. The server goes on meanwhile. The copy is there whole or not at all, for its owner alone, and checked:
/// the database, and that what it names is there and has the hash that it should. Keep it as secret as the server.
#[derive(Debug, Args)]
pub struct BackupCommand {
    /// The folder to make; one that exists must be empty
    folder: PathBuf,
    /// Configuration file [default: faceoff.toml in the working folder, if there is one]
    #[arg(long, value_name = "FILE", env = "FACEOFF_CONFIG")]
    config: Option<PathBuf>,
    /// The server's data folder; replaces server.data_dir of the configuration
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// Print what was done as JSON
    #[arg(long)]
    json: bool,
}

const BACKUP: Kind = Kind {
    name: "backup",
    suffix: "backing-up",
};

impl BackupCommand {
    /// Makes the backup, and says what is in it.
    ///
    /// # Errors
    /// If something cannot be read or written: then there is none. If the data folder lacks something that its database
    /// names: then there is a backup of what there is.
    pub fn run(self) -> anyhow::Result<()> {
        let data_dir = match self.data_dir {
            Some(folder) => folder,
            None => Config::load(self.config.as_deref())?.server.data_dir,
        };
        let manifest = back_up(&data_dir, &self.folder, Timestamp::now())?;
        print(self.json, &manifest.told(&self.folder), || {
            let mut text = format!(
                "backed up {:?} to {}: {} files, {}",
                manifest.season,
                self.folder.display(),
                manifest.files.len(),
                bytes(manifest.total_bytes())
            );
            if manifest.missing.is_empty() {
                text.push_str(&format!(
                    "\nchecked: the database is whole, and all that it names is there as it was stored\n\
                     to go back: faceoff restore {} --data FOLDER",
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
            "the backup is made, but {} of what the database names is not in {} as it was stored; what the backup holds \
             can be restored",
            manifest.missing.len(),
            data_dir.display()
        )
    }
}

/// Makes it: all of it or nothing.
fn back_up(data_dir: &Path, target: &Path, now: Timestamp) -> anyhow::Result<Manifest> {
    staging::check_empty(
        target,
        "each backup has a folder of its own: name one that is empty or not there yet",
    )?;
    let absolute = |path: &Path| {
        std::path::absolute(path).with_context(|| format!("looking for {}", path.display()))
    };
    if absolute(target)?.starts_with(absolute(data_dir)?) {
        bail!(
            "{} is inside the data folder: a backup belongs elsewhere, best on another disk",
            target.display()
        );
    }
    let staging = Staging::make(target, &BACKUP)?;
    let folder = staging.content();
    staging::private(&folder)?;
    let database = folder.join(DATABASE);
    // First: what it names is written before it is named, and stays for a day after it is no longer needed.
    let checked = super::block_on(async {
        match Store::copy_database(data_dir, &database).await {
            Err(StoreError::NotFound(_)) => bail!(
                "{} is no data folder of a server: there is no {DATABASE} in it; name it with --data-dir",
                data_dir.display()
            ),
            copied => {
                copied.with_context(|| format!("copying the database of {}", data_dir.display()))?
            }
        }
        Store::check_database(&database, staging.scratch())
            .await
            .context("the copy of the database")
    })?;
    let mut copied = BTreeMap::new();
    copied.insert(DATABASE.to_owned(), files::settle(&database)?);
    let artifacts = folder.join(ARTIFACTS);
    copy_tree(
        &data_dir.join(ARTIFACTS),
        &artifacts,
        ARTIFACTS,
        &mut copied,
    )?;
    let token = data_dir.join(ADMIN_TOKEN_FILE);
    if token.exists() {
        let file = copy_whole(&token, &folder.join(ADMIN_TOKEN_FILE))?;
        copied.insert(ADMIN_TOKEN_FILE.to_owned(), file);
    }
    let manifest = Manifest {
        format: manifest::FORMAT,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        schema: checked.schema,
        season: checked.season,
        made_at: now,
        missing: missing(&checked.needed, &copied),
        files: copied
            .into_iter()
            .map(|(path, file)| Part {
                path,
                bytes: file.bytes,
                blake3: file.blake3,
            })
            .collect(),
    };
    let json = serde_json::to_vec_pretty(&manifest).context("writing the manifest")?;
    files::write(&folder.join(MANIFEST), &json)?;
    staging.settle(target, &[])?;
    Ok(manifest)
}

/// What the database names and the data folder does not have, or has otherwise.
fn missing(needed: &[Needed], copied: &BTreeMap<String, Copied>) -> Vec<Missing> {
    let path = |key: &str| format!("{ARTIFACTS}/{key}");
    let mut missing = Vec::new();
    for one in needed {
        match one {
            Needed::File { key, blake3 } => match (copied.get(&path(key)), blake3) {
                (None, _) => missing.push(Missing::Gone { path: path(key) }),
                (Some(found), Some(blake3)) if found.blake3 != *blake3 => {
                    missing.push(Missing::Changed {
                        path: path(key),
                        expected: blake3.clone(),
                        found: found.blake3.clone(),
                    });
                }
                (Some(_), _) => {}
            },
            Needed::Folder { key } => {
                let prefix = format!("{}/", path(key));
                let first = copied.range(prefix.clone()..).next();
                if !first.is_some_and(|(name, _)| name.starts_with(&prefix)) {
                    missing.push(Missing::Gone { path: prefix });
                }
            }
        }
    }
    missing
}

/// The folder of a backup, as its manifest tells.
///
/// # Errors
/// If it is none, or of a later version.
pub fn open(folder: &Path) -> anyhow::Result<Manifest> {
    let file = folder.join(MANIFEST);
    let text = fs::read(&file).with_context(|| {
        format!(
            "{} is no backup that `faceoff backup` has made: reading {MANIFEST} in it",
            folder.display()
        )
    })?;
    Manifest::parse(&text).with_context(|| format!("{}", file.display()))
}
