//! Folders that are made whole or not at all: beside where they will be, and named last.

use anyhow::{Context, bail};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use std::{
    fs::{self, DirBuilder, File, TryLockError},
    io::ErrorKind,
    os::unix::fs::{DirBuilderExt, MetadataExt},
    path::{Path, PathBuf},
};

/// What makes a folder.
pub struct Kind {
    /// In messages, and in the name of the lock by which a folder that was left is known.
    pub name: &'static str,
    /// Of the folder in which it is made.
    pub suffix: &'static str,
}

/// Refuses a folder that holds anything; `why` says what it is to be empty for.
///
/// # Errors
/// If it holds something, or cannot be looked into.
pub fn check_empty(folder: &Path, why: &str) -> anyhow::Result<()> {
    match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error).with_context(|| format!("looking into {}", folder.display())),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => bail!("{} is not empty, and {why}", folder.display()),
        },
    }
}

/// A folder that only its owner can read.
///
/// # Errors
/// If it cannot be made.
pub fn private(folder: &Path) -> anyhow::Result<()> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .with_context(|| format!("making the folder {}", folder.display()))
}

/// The folder beside the one to be made, in which it is made; removed unless it settles, by the next one after a kill.
pub struct Staging {
    folder: PathBuf,
    /// Held as long as it is used.
    _lock: File,
}

impl Staging {
    /// Begins to make `target`.
    ///
    /// # Errors
    /// If another does, something else is in the way, or the disk refuses.
    pub fn make(target: &Path, kind: &Kind) -> anyhow::Result<Self> {
        let Some(name) = target.file_name() else {
            bail!("{} names no folder that could be made", target.display());
        };
        let mut name = name.to_owned();
        name.push(format!(".{}", kind.suffix));
        let folder = target.with_file_name(name);
        let mark = folder.join(format!("faceoff-{}.lock", kind.name));
        if folder.exists() {
            let left = File::open(&mark).with_context(|| {
                format!(
                    "{} is in the way, and no {} has left it: move it, or name another folder",
                    folder.display(),
                    kind.name
                )
            })?;
            match left.try_lock() {
                Ok(()) => fs::remove_dir_all(&folder)
                    .with_context(|| format!("removing {}", folder.display()))?,
                Err(TryLockError::WouldBlock) => bail!(
                    "another {} into {} is under way",
                    kind.name,
                    target.display()
                ),
                Err(TryLockError::Error(error)) => {
                    return Err(error).with_context(|| format!("locking {}", mark.display()));
                }
            }
        }
        let parent = parent_of(&folder);
        private(parent)?;
        check_disk(target, parent)?;
        // Not one that is there by now, and might be somebody else's.
        DirBuilder::new()
            .mode(0o700)
            .create(&folder)
            .with_context(|| format!("making the folder {}", folder.display()))?;
        let lock = File::create_new(&mark).with_context(|| format!("making {}", mark.display()))?;
        lock.lock()
            .with_context(|| format!("locking {}", mark.display()))?;
        Ok(Self {
            folder,
            _lock: lock,
        })
    }

    /// What will be the folder; it is not there yet.
    #[must_use]
    pub fn content(&self) -> PathBuf {
        self.folder.join("data")
    }

    /// For what is needed on the way.
    #[must_use]
    pub fn scratch(&self) -> &Path {
        &self.folder
    }

    /// Has what was made be the target. Its files are on disk; `folders` of it are seen to here, and itself.
    ///
    /// # Errors
    /// If the target holds something by now, or the disk refuses.
    pub fn settle(self, target: &Path, folders: &[&str]) -> anyhow::Result<()> {
        let made = self.on_disk(folders)?;
        // Takes the place of an empty folder, and of nothing else.
        fs::rename(&made, target).with_context(|| format!("naming {}", target.display()))?;
        sync(parent_of(&self.folder))
    }

    /// Has the names of these folders of it on disk, and its own; where it is.
    fn on_disk(&self, folders: &[&str]) -> anyhow::Result<PathBuf> {
        let made = self.content();
        for folder in folders {
            sync(&made.join(folder))?;
        }
        sync(&made)?;
        Ok(made)
    }

    /// Has what was made be the target in place of what is there, which is then named `aside`.
    ///
    /// # Errors
    /// If the disk refuses; what was there is where it was.
    pub fn replace(self, target: &Path, folders: &[&str], aside: &Path) -> anyhow::Result<()> {
        let made = self.on_disk(folders)?;
        // First under the other name, then both names in one step: there is a target at any moment, and what was there is
        // never in the folder that is removed in the end.
        fs::rename(&made, aside).with_context(|| format!("naming {}", aside.display()))?;
        if let Err(error) = renameat_with(CWD, aside, CWD, target, RenameFlags::EXCHANGE) {
            // What was made, which can be made again.
            let _ = fs::remove_dir_all(aside);
            return Err(error).with_context(|| format!("naming {}", target.display()));
        }
        sync(parent_of(&self.folder))
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // What stays is removed by the next one.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Where a folder is; what has no parent is in the working folder.
fn parent_of(folder: &Path) -> &Path {
    match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Refuses a target that nothing could be renamed to: the root of another file system, or a link.
fn check_disk(target: &Path, parent: &Path) -> anyhow::Result<()> {
    let Ok(found) = fs::symlink_metadata(target) else {
        return Ok(());
    };
    if found.is_symlink() {
        bail!("{} is a link: name the folder itself", target.display());
    }
    let parent =
        fs::metadata(parent).with_context(|| format!("looking at {}", parent.display()))?;
    if found.dev() != parent.dev() {
        bail!(
            "{} is where a file system is mounted, and a folder that appears whole must be made beside its place: name a \
             folder inside it",
            target.display()
        );
    }
    Ok(())
}

/// Has a folder's names on disk.
///
/// # Errors
/// If the disk refuses.
pub fn sync(folder: &Path) -> anyhow::Result<()> {
    File::open(folder)
        .and_then(|folder| folder.sync_all())
        .with_context(|| format!("writing {}", folder.display()))
}
