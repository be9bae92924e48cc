//! `faceoff import`: takes the archive of a season in, for `faceoff serve` to show it.

use anyhow::{Context, bail};
use clap::Args;
use faceoff_archive::{MANIFEST_NAME, Manifest, unpack};
use faceoff_store::Store;
use jiff::Timestamp;
use std::{
    fs::{self, DirBuilder, File, TryLockError},
    io::ErrorKind,
    os::unix::fs::DirBuilderExt,
    path::{Path, PathBuf},
};

/// The database's file in an archive, and in a data folder.
const DATABASE: (&str, &str) = ("database.sqlite3", "faceoff.sqlite3");
/// The artifacts, in both.
const ARTIFACTS: &str = "artifacts";
/// Where everything else of the archive stays.
const REST: &str = "archive";
/// By which a folder that an import was killed in is known.
const MARK: &str = "faceoff-import.lock";

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
}

impl ImportCommand {
    /// Imports it.
    ///
    /// # Errors
    /// If the folder holds something, or the archive is refused; nothing is left of it then.
    pub fn run(self) -> anyhow::Result<()> {
        let manifest = import(&self.archive, &self.data, Timestamp::now())?;
        println!(
            "imported the {} archive of {:?} as it was at {}: {} files of {} bytes",
            manifest.edition,
            manifest.season,
            manifest.made_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
            manifest.files.len(),
            manifest.total_bytes()
        );
        for what in &manifest.left_out {
            println!("the archive was made without {what}");
        }
        println!(
            "next: `faceoff serve --data-dir {}` shows it, read-only",
            self.data.display()
        );
        Ok(())
    }
}

/// Makes the data folder `data` of an archive: all of it or nothing.
///
/// # Errors
/// As [`ImportCommand::run`].
pub fn import(archive: &Path, data: &Path, now: Timestamp) -> anyhow::Result<Manifest> {
    check_empty(data)?;
    let staging = Staging::make(data)?;
    let folder = staging.folder.join("data");
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
    staging.settle(data)?;
    Ok(manifest)
}

/// Refuses to unpack over anything.
fn check_empty(data: &Path) -> anyhow::Result<()> {
    match fs::read_dir(data) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error).with_context(|| format!("looking into {}", data.display())),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => bail!(
                "{} is not empty, and an archive is imported into a folder of its own: name one that is empty or not \
                 there yet",
                data.display()
            ),
        },
    }
}

/// A folder that only its owner can read.
fn private(folder: &Path) -> anyhow::Result<()> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .with_context(|| format!("making the folder {}", folder.display()))
}

/// The folder beside the one to be made, in which it is made; removed unless it settles, by the next import after a
/// kill.
struct Staging {
    folder: PathBuf,
    /// Held as long as it is used.
    _lock: File,
}

impl Staging {
    fn make(data: &Path) -> anyhow::Result<Self> {
        let Some(name) = data.file_name() else {
            bail!("{} names no folder that could be made", data.display());
        };
        let mut name = name.to_owned();
        name.push(".importing");
        let folder = data.with_file_name(name);
        let mark = folder.join(MARK);
        if folder.exists() {
            let left = File::open(&mark).with_context(|| {
                format!(
                    "{} is in the way, and no import has left it: move it, or name another folder",
                    folder.display()
                )
            })?;
            match left.try_lock() {
                Ok(()) => fs::remove_dir_all(&folder)
                    .with_context(|| format!("removing {}", folder.display()))?,
                Err(TryLockError::WouldBlock) => {
                    bail!("another import into {} is under way", data.display())
                }
                Err(TryLockError::Error(error)) => {
                    return Err(error).with_context(|| format!("locking {}", mark.display()));
                }
            }
        }
        private(&folder)?;
        let lock = File::create_new(&mark).with_context(|| format!("making {}", mark.display()))?;
        lock.lock()
            .with_context(|| format!("locking {}", mark.display()))?;
        Ok(Self {
            folder,
            _lock: lock,
        })
    }

    /// Has what was made be the data folder.
    fn settle(self, data: &Path) -> anyhow::Result<()> {
        let made = self.folder.join("data");
        // On disk before it counts; its files were, one by one.
        for folder in [made.join(REST), made.join(ARTIFACTS), made.clone()] {
            File::open(&folder)
                .and_then(|folder| folder.sync_all())
                .with_context(|| format!("writing {}", folder.display()))?;
        }
        // Takes the place of an empty folder, and of nothing else.
        fs::rename(&made, data).with_context(|| format!("naming {}", data.display()))?;
        if let Some(parent) = self.folder.parent().filter(|parent| parent.is_dir()) {
            File::open(parent)
                .and_then(|parent| parent.sync_all())
                .with_context(|| format!("writing {}", parent.display()))?;
        }
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // What stays is removed by the next import.
        let _ = fs::remove_dir_all(&self.folder);
    }
}
