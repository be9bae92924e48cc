//! Folders that are created completely or not at all: built beside their target and renamed at the end.

use anyhow::{Context, bail};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use std::{
    fs::{self, DirBuilder, File, TryLockError},
    io::ErrorKind,
    os::unix::fs::{DirBuilderExt, MetadataExt},
    path::{Path, PathBuf},
};

/// An operation that creates a folder: `backup`, `restore` or `import`.
pub struct FolderOperation {
    /// The operation, for messages and for the name of the lock file.
    pub name: &'static str,
    /// Suffix of the temporary folder: it is beside the target, and its name is the target's with a dot and this suffix.
    pub suffix: &'static str,
}

/// Refuses a folder that is not empty. `reason`, which says why the folder must be empty, completes the message.
///
/// # Errors
/// If the folder is not empty, or cannot be read.
pub fn check_empty(folder: &Path, reason: &str) -> anyhow::Result<()> {
    match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error).with_context(|| format!("reading {}", folder.display())),
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => bail!("{} is not empty, and {reason}", folder.display()),
        },
    }
}

/// Creates a folder that only its owner can read.
///
/// # Errors
/// If the folder cannot be created.
pub fn create_private(folder: &Path) -> anyhow::Result<()> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .with_context(|| format!("creating the folder {}", folder.display()))
}

/// A temporary folder beside the target. It is removed unless committed; after a kill, the next run removes it.
pub struct AtomicFolder {
    folder: PathBuf,
    /// Locked as long as the folder is in use.
    _lock: File,
}

impl AtomicFolder {
    /// Creates the temporary folder of `target`.
    ///
    /// # Errors
    /// If another process is building `target`, a foreign folder has the temporary name, or a file cannot be written.
    pub fn create(target: &Path, operation: &FolderOperation) -> anyhow::Result<Self> {
        let Some(name) = target.file_name() else {
            bail!("{} is not a folder that can be created", target.display());
        };
        let mut name = name.to_owned();
        name.push(format!(".{}", operation.suffix));
        let folder = target.with_file_name(name);
        let lock_path = folder.join(format!("faceoff-{}.lock", operation.name));
        if folder.exists() {
            let old_lock = File::open(&lock_path).with_context(|| {
                format!(
                    "{} already exists and is not from an interrupted {}: move it, or name another folder",
                    folder.display(),
                    operation.name
                )
            })?;
            match old_lock.try_lock() {
                Ok(()) => fs::remove_dir_all(&folder)
                    .with_context(|| format!("removing {}", folder.display()))?,
                Err(TryLockError::WouldBlock) => {
                    bail!(
                        "another {} into {} is running",
                        operation.name,
                        target.display()
                    )
                }
                Err(TryLockError::Error(error)) => {
                    return Err(error).with_context(|| format!("locking {}", lock_path.display()));
                }
            }
        }
        let parent = parent_of(&folder);
        create_private(parent)?;
        check_renameable(target, parent)?;
        // Fails if the folder has been created meanwhile, possibly by another user.
        DirBuilder::new()
            .mode(0o700)
            .create(&folder)
            .with_context(|| format!("creating the folder {}", folder.display()))?;
        let lock = File::create_new(&lock_path)
            .with_context(|| format!("creating {}", lock_path.display()))?;
        lock.lock()
            .with_context(|| format!("locking {}", lock_path.display()))?;
        Ok(Self {
            folder,
            _lock: lock,
        })
    }

    /// The path of the content, which the caller creates.
    #[must_use]
    pub fn content(&self) -> PathBuf {
        self.folder.join("data")
    }

    /// A folder for temporary files, which is removed at the end.
    #[must_use]
    pub fn scratch(&self) -> &Path {
        &self.folder
    }

    /// Moves the content to the target. The caller has synced the files to disk; `folders`, relative to the content, and the
    /// content itself are synced here.
    ///
    /// # Errors
    /// If the target is not empty any more, or a folder cannot be synced or renamed.
    pub fn commit(self, target: &Path, folders: &[&str]) -> anyhow::Result<()> {
        let content = self.sync_content(folders)?;
        // The target must be empty or absent; rename refuses everything else.
        fs::rename(&content, target).with_context(|| format!("naming {}", target.display()))?;
        sync(parent_of(&self.folder))
    }

    /// Syncs the given folders and the content itself to disk; returns the path of the content.
    fn sync_content(&self, folders: &[&str]) -> anyhow::Result<PathBuf> {
        let content = self.content();
        for folder in folders {
            sync(&content.join(folder))?;
        }
        sync(&content)?;
        Ok(content)
    }

    /// Replaces the target with the content, as [`commit`](Self::commit) does; the old target is renamed to `old_target`.
    ///
    /// # Errors
    /// If a folder cannot be synced or renamed. The target is unchanged then.
    pub fn replace(self, target: &Path, folders: &[&str], old_target: &Path) -> anyhow::Result<()> {
        let content = self.sync_content(folders)?;
        // The content first gets the new name of the old target, then both names are exchanged in one step. So the
        // target always exists, and the old one is never inside the temporary folder that is removed.
        fs::rename(&content, old_target)
            .with_context(|| format!("naming {}", old_target.display()))?;
        if let Err(error) = renameat_with(CWD, old_target, CWD, target, RenameFlags::EXCHANGE) {
            // This is the new content, which can be created again.
            let _ = fs::remove_dir_all(old_target);
            return Err(error).with_context(|| format!("naming {}", target.display()));
        }
        sync(parent_of(&self.folder))
    }
}

impl Drop for AtomicFolder {
    fn drop(&mut self) {
        // If this fails, the next run removes the folder.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The parent of a folder; the working folder if the path has none.
fn parent_of(folder: &Path) -> &Path {
    match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Refuses a target that cannot be replaced by renaming: the root of another file system, or a symbolic link.
fn check_renameable(target: &Path, parent: &Path) -> anyhow::Result<()> {
    let Ok(found) = fs::symlink_metadata(target) else {
        return Ok(());
    };
    if found.is_symlink() {
        bail!(
            "{} is a symbolic link: name the folder itself",
            target.display()
        );
    }
    let parent = fs::metadata(parent).with_context(|| format!("reading {}", parent.display()))?;
    if found.dev() != parent.dev() {
        bail!(
            "{} is a mount point, and the folder is built beside its target and renamed: name a \
            folder inside it",
            target.display()
        );
    }
    Ok(())
}

/// Syncs a file, or the entries of a folder, to disk.
///
/// # Errors
/// If it cannot be synced.
pub fn sync(path: &Path) -> anyhow::Result<()> {
    File::open(path)
        .and_then(|opened| opened.sync_all())
        .with_context(|| format!("writing {}", path.display()))
}
