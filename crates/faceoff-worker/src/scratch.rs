//! A worker's scratch folder: temporary files of its slots, and the lock that reserves the folder for one process.

use anyhow::Context as _;
use fs_err::{self as fs, File};
use std::{
    fs::TryLockError,
    io::{Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
};
use uuid::Uuid;

/// The folder for unpacked bundles and uncommitted recordings. Its content is temporary and is removed at the start.
/// Only one process at a time may use it.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: PathBuf,
    /// See [`Self::worker()`].
    worker: String,
    /// Locked as long as this value exists.
    _lock: File,
}

impl Scratch {
    /// Locks the folder, creating it if necessary, and removes leftovers of an earlier process.
    pub(crate) fn take(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).context("making the scratch folder")?;
        let mut lock = fs::OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(folder.join("lock"))
            .context("taking the scratch folder")?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => anyhow::bail!(
                "the scratch folder {} is used by another process: give each its own",
                folder.display()
            ),
            Err(TryLockError::Error(error)) => {
                return Err(error)
                    .with_context(|| format!("locking the scratch folder {}", folder.display()));
            }
        }
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let is_slot_folder = entry
                .file_name()
                .to_str()
                .is_some_and(|name| name.starts_with("slot-"));
            if is_slot_folder {
                fs::remove_dir_all(entry.path())?;
            }
        }
        let worker = worker_name(&mut lock).context("cannot store the worker's name")?;
        Ok(Self {
            folder: folder.to_owned(),
            worker,
            _lock: lock,
        })
    }

    /// The name of the worker that uses this folder; it persists across processes. The lock is held, so all earlier
    /// processes have ended.
    pub(crate) fn worker(&self) -> &str {
        &self.worker
    }

    /// The empty folder of one slot.
    pub(crate) fn slot(&self, index: usize) -> anyhow::Result<PathBuf> {
        let folder = self.folder.join(format!("slot-{index}"));
        fs::create_dir(&folder)?;
        Ok(folder)
    }
}

/// Reads the name from the lock file, or writes a new one.
fn worker_name(lock: &mut File) -> std::io::Result<String> {
    let mut text = String::new();
    lock.read_to_string(&mut text)?;
    if let Ok(id) = Uuid::parse_str(text.trim()) {
        return Ok(id.to_string());
    }
    let name = Uuid::now_v7().to_string();
    lock.set_len(0)?;
    lock.seek(SeekFrom::Start(0))?;
    lock.write_all(name.as_bytes())?;
    Ok(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scratch_removes_leftovers_but_no_other_files() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("slot-7/leftover")).unwrap();
        fs::write(folder.path().join("notes.txt"), "a file of the user").unwrap();
        let scratch = Scratch::take(folder.path()).unwrap();
        assert!(!folder.path().join("slot-7").exists());
        assert!(folder.path().join("notes.txt").exists());
        assert!(scratch.slot(0).unwrap().is_dir());
    }

    #[test]
    fn scratch_is_refused_to_a_second_process() {
        let folder = tempfile::tempdir().unwrap();
        let scratch = Scratch::take(folder.path()).unwrap();
        let error = Scratch::take(folder.path()).unwrap_err().to_string();
        assert!(error.contains("used by another process"), "{error}");
        let name = scratch.worker().to_owned();
        drop(scratch);
        assert_eq!(
            Scratch::take(folder.path()).unwrap().worker(),
            name,
            "the name persists"
        );
    }
}
