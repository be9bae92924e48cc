use rustix::fs::statvfs;
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// Fewer free entries of a file system than this are as good as none: one bundle may bring thousands.
const MIN_FREE_FILES: u64 = 1000;

/// The disks that the server writes to, and how much of each must stay free. Below that no work is
/// begun and nothing is taken in: what is begun must have room to end, and a result must never depend
/// on who filled the disk.
#[derive(Debug)]
pub struct Room {
    folders: Vec<PathBuf>,
    min_free_bytes: u64,
    /// What the log was told last.
    short: Mutex<bool>,
}

impl Room {
    /// Watches the file systems of existing `folders`, each of which must have `min_free_bytes` to
    /// spare. 0: there is always room.
    #[must_use]
    pub fn new(folders: Vec<PathBuf>, min_free_bytes: u64) -> Self {
        Self {
            folders,
            min_free_bytes,
            short: Mutex::new(false),
        }
    }

    /// How much must stay free on each disk, in bytes.
    #[must_use]
    pub const fn min_free_bytes(&self) -> u64 {
        self.min_free_bytes
    }

    /// How much each of the watched folders' file systems has, in their order; `None` of one that cannot be asked.
    #[must_use]
    pub fn disks(&self) -> Vec<Option<DiskSpace>> {
        let folders = self.folders.iter();
        folders.map(|folder| DiskSpace::of(folder)).collect()
    }

    /// Is there too little room? The disks are looked at now, and whoever finds a change tells the log
    /// of it. What was short is enough again with an eighth more, so that work under way, which comes
    /// and goes with its files, does not switch back and forth.
    #[must_use]
    pub fn is_short(&self) -> bool {
        if self.min_free_bytes == 0 {
            return false;
        }
        // whoever panicked left a whole value behind
        let mut short = self.short.lock().unwrap_or_else(PoisonError::into_inner);
        let wanted_bytes = if *short {
            self.min_free_bytes.saturating_add(self.min_free_bytes / 8)
        } else {
            self.min_free_bytes
        };
        let lack = self
            .folders
            .iter()
            .find_map(|folder| Lack::of(folder, wanted_bytes));
        match (&lack, *short) {
            (Some(lack), false) => tracing::warn!(
                folder = %lack.folder.display(),
                found = lack.found,
                min_free_bytes = self.min_free_bytes,
                "too little room on the disk: the queue pauses and uploads are refused until there is more"
            ),
            (None, true) => tracing::info!("there is room on the disk again: the queue goes on"),
            _ => {}
        }
        *short = lack.is_some();
        *short
    }
}

/// What a file system has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiskSpace {
    /// Bytes that this process may still write.
    pub free_bytes: u64,
    pub size_bytes: u64,
}

impl DiskSpace {
    fn of(folder: &Path) -> Option<Self> {
        let disk = statvfs(folder).ok()?;
        Some(Self {
            free_bytes: disk.f_bavail.saturating_mul(disk.f_frsize),
            size_bytes: disk.f_blocks.saturating_mul(disk.f_frsize),
        })
    }
}

/// A disk that has not what it should.
struct Lack<'a> {
    folder: &'a Path,
    found: String,
}

impl<'a> Lack<'a> {
    fn of(folder: &'a Path, wanted_bytes: u64) -> Option<Self> {
        let found = match statvfs(folder) {
            Ok(disk) => {
                let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
                // some file systems do not count their entries
                if free_bytes >= wanted_bytes
                    && (disk.f_files == 0 || disk.f_favail >= MIN_FREE_FILES)
                {
                    return None;
                }
                format!("{free_bytes} bytes and {} files are free", disk.f_favail)
            }
            // where nothing can be asked, nothing can be written
            Err(error) => format!("it cannot be asked: {error}"),
        };
        Some(Self { folder, found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_temporary_files(min_free_bytes: u64) -> Room {
        Room::new(vec![std::env::temp_dir()], min_free_bytes)
    }

    #[test]
    fn a_disk_is_short_of_what_it_must_have() {
        assert!(!of_temporary_files(0).is_short());
        assert!(!of_temporary_files(1).is_short());
        assert!(of_temporary_files(u64::MAX).is_short());
    }

    #[test]
    fn a_folder_that_is_gone_has_no_room() {
        let folders = vec![std::env::temp_dir(), "/nowhere/at/all".into()];
        assert!(Room::new(folders, 1).is_short());
    }
}
