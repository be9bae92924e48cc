//! Files that are written completely or not at all: beside their target, and renamed at the end.

use super::atomic_folder::sync;
use crate::client::with_suffix;
use anyhow::Context;
use faceoff_dataset::allow_missing;
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

/// A partial file beside its target, which it replaces. It is removed unless committed; after a kill, the next run removes it.
#[derive(Debug)]
pub struct AtomicFile {
    partial: PathBuf,
    target: PathBuf,
}

impl AtomicFile {
    /// Creates the partial file of `target`, which is empty.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn create(target: &Path) -> anyhow::Result<Self> {
        // The file of a symbolic link is replaced, not the link.
        let target = target.canonicalize().unwrap_or_else(|_| target.to_owned());
        let partial = with_suffix(&target, ".part");
        allow_missing(fs::remove_file(&partial))
            .and_then(|()| File::create_new(&partial))
            .with_context(|| format!("creating {}", partial.display()))?;
        Ok(Self { partial, target })
    }

    /// The path of the partial file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Writes the content and commits it.
    ///
    /// # Errors
    /// If the file cannot be written. The target is unchanged then.
    pub fn write(self, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
        fs::write(&self.partial, content)
            .with_context(|| format!("writing {}", self.partial.display()))?;
        self.commit()
    }

    /// Replaces the target with the partial file.
    ///
    /// # Errors
    /// If the file cannot be synced or renamed. The target is unchanged then.
    pub fn commit(self) -> anyhow::Result<()> {
        sync(&self.partial)?;
        fs::rename(&self.partial, &self.target)
            .with_context(|| format!("naming {}", self.target.display()))
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        // After a commit there is none. If this fails, the next run removes it.
        let _ = fs::remove_file(&self.partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn target_keeps_its_content_until_the_commit() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("goal.mp4");
        fs::write(&target, "old").unwrap();
        let abandoned = AtomicFile::create(&target).unwrap();
        fs::write(abandoned.path(), "half").unwrap();
        drop(abandoned);
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        // Of a run that was killed.
        fs::write(dir.path().join("goal.mp4.part"), "half").unwrap();
        AtomicFile::create(&target).unwrap().write("new").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(dir.path().read_dir().unwrap().count(), 1);
    }

    #[test]
    fn symbolic_link_keeps_its_target() {
        let dir = tempfile::tempdir().unwrap();
        let [file, link] = ["file.gif", "link.gif"].map(|name| dir.path().join(name));
        fs::write(&file, "old").unwrap();
        symlink(&file, &link).unwrap();
        AtomicFile::create(&link).unwrap().write("new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    }

    #[test]
    fn missing_folder_is_refused_at_creation() {
        let dir = tempfile::tempdir().unwrap();
        let error = AtomicFile::create(&dir.path().join("missing/goal.gif")).unwrap_err();
        assert!(error.to_string().starts_with("creating "), "{error}");
    }
}
