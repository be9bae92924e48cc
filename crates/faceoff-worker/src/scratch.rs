use anyhow::Context as _;
use fs_err::{self as fs, File};
use std::{
    fs::TryLockError,
    io::{Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
};
use uuid::Uuid;

/// The folder for what is unpacked and recorded until it is committed. Nothing in it is worth
/// keeping, so it is emptied at the start; it belongs to one process at a time.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: PathBuf,
    worker: String,
    _lock: File,
}

impl Scratch {
    /// Takes the folder, creating it if need be, and removes what an earlier process left.
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
            let ours = entry
                .file_name()
                .to_str()
                .is_some_and(|name| name.starts_with("slot-"));
            if ours {
                fs::remove_dir_all(entry.path())?;
            }
        }
        let worker = worker_name(&mut lock).context("cannot keep the worker's name")?;
        Ok(Self {
            folder: folder.to_owned(),
            worker,
            _lock: lock,
        })
    }

    /// The name of whoever holds this folder, from one process to the next. Since the lock is ours,
    /// all earlier holders are dead.
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

/// Reads the name from the lock file, or draws and writes one.
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
        let name = scratch.worker().to_owned();
        drop(scratch);
        assert_eq!(
            Scratch::take(folder.path()).unwrap().worker(),
            name,
            "the name stays"
        );
    }
}
