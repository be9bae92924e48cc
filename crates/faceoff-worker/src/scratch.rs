use anyhow::Context as _;
use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

/// The folder for what is unpacked and recorded until it is committed. Nothing in it is worth
/// keeping, so it is emptied at the start; it belongs to one process at a time.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: PathBuf,
    _lock: File,
}

impl Scratch {
    /// Takes the folder, creating it if need be, and removes what an earlier process left.
    pub(crate) fn take(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the scratch folder {}", folder.display()))?;
        let lock = File::create(folder.join("lock"))
            .with_context(|| format!("cannot write to the scratch folder {}", folder.display()))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => anyhow::bail!(
                "the scratch folder {} is used by another process: give each its own",
                folder.display()
            ),
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| {
                    format!("cannot lock the scratch folder {}", folder.display())
                });
            }
        }
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let ours = entry
                .file_name()
                .to_str()
                .is_some_and(|name| name.starts_with("slot-"));
            if ours {
                fs::remove_dir_all(entry.path())
                    .with_context(|| format!("cannot remove {}", entry.path().display()))?;
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            _lock: lock,
        })
    }

    /// The empty folder of one slot.
    pub(crate) fn slot(&self, index: usize) -> anyhow::Result<PathBuf> {
        let folder = self.folder.join(format!("slot-{index}"));
        fs::create_dir(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        Ok(folder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leftovers_are_removed_and_foreign_files_kept() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("slot-7/bundle/x")).unwrap();
        fs::write(folder.path().join("notes.txt"), "not ours").unwrap();
        let scratch = Scratch::take(folder.path()).unwrap();
        assert!(!folder.path().join("slot-7").exists());
        assert!(folder.path().join("notes.txt").exists());
        assert!(scratch.slot(0).unwrap().is_dir());
    }

    #[test]
    fn a_second_process_is_turned_away() {
        let folder = tempfile::tempdir().unwrap();
        let scratch = Scratch::take(folder.path()).unwrap();
        let error = Scratch::take(folder.path()).unwrap_err().to_string();
        assert!(error.contains("used by another process"), "{error}");
        drop(scratch);
        Scratch::take(folder.path()).unwrap();
    }
}
