//! Supervision of the free disk space that jobs and uploads need.

use rustix::fs::statvfs;
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// Minimum number of free inodes of a file system: one bundle may contain thousands of files.
const MIN_FREE_FILES: u64 = 1000;

/// The disks that the server writes to, and how much of each must stay free. Below this minimum no job starts and
/// no upload is accepted: a started job must have the space to finish, and a result must never depend on
/// how full the disk is.
#[derive(Debug)]
pub struct FreeSpace {
    folders: Vec<PathBuf>,
    min_free_bytes: u64,
    /// Was space short at the last check? A change is logged.
    is_short: Mutex<bool>,
}

impl FreeSpace {
    /// Watches the file systems of existing `folders`, each of which must have `min_free_bytes` free.
    /// 0 disables the check.
    #[must_use]
    pub fn new(folders: Vec<PathBuf>, min_free_bytes: u64) -> Self {
        Self {
            folders,
            min_free_bytes,
            is_short: Mutex::new(false),
        }
    }

    /// Bytes that must stay free on each disk.
    #[must_use]
    pub const fn min_free_bytes(&self) -> u64 {
        self.min_free_bytes
    }

    /// Space of the file systems of the watched folders, in their order; `None` for one that cannot be read.
    #[must_use]
    pub fn disks(&self) -> Vec<Option<DiskSpace>> {
        let folders = self.folders.iter();
        folders.map(|folder| DiskSpace::of(folder)).collect()
    }

    /// Is there too little free space? The disks are checked on each call, and a change is logged. Once space
    /// is short, an eighth more than the minimum must be free before it counts as enough again. So temporary files of
    /// running jobs do not toggle the answer.
    #[must_use]
    pub fn is_short(&self) -> bool {
        if self.min_free_bytes == 0 {
            return false;
        }
        // a panic of another thread leaves the value consistent
        let mut is_short = self.is_short.lock().unwrap_or_else(PoisonError::into_inner);
        let needed_bytes = if *is_short {
            self.min_free_bytes.saturating_add(self.min_free_bytes / 8)
        } else {
            self.min_free_bytes
        };
        let shortage = self
            .folders
            .iter()
            .find_map(|folder| Shortage::find(folder, needed_bytes));
        match (&shortage, *is_short) {
            (Some(shortage), false) => tracing::warn!(
                folder = %shortage.folder.display(),
                found = shortage.description,
                min_free_bytes = self.min_free_bytes,
                "too little free disk space: the queue pauses and uploads are refused until there is more"
            ),
            (None, true) => tracing::info!("enough free disk space again: the queue resumes"),
            _ => {}
        }
        *is_short = shortage.is_some();
        *is_short
    }
}

/// Space of a file system.
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

/// A disk with too little free space.
struct Shortage<'a> {
    folder: &'a Path,
    /// How much is free, or why this is unknown.
    description: String,
}

impl<'a> Shortage<'a> {
    fn find(folder: &'a Path, needed_bytes: u64) -> Option<Self> {
        let description = match statvfs(folder) {
            Ok(disk) => {
                let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
                // some file systems do not count their inodes
                if free_bytes >= needed_bytes
                    && (disk.f_files == 0 || disk.f_favail >= MIN_FREE_FILES)
                {
                    return None;
                }
                format!("{free_bytes} bytes and {} files are free", disk.f_favail)
            }
            // a file system that cannot be read cannot be written either
            Err(error) => format!("it cannot be read: {error}"),
        };
        Some(Self {
            folder,
            description,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn temp_folder_space(min_free_bytes: u64) -> FreeSpace {
        FreeSpace::new(vec![std::env::temp_dir()], min_free_bytes)
    }

    #[test]
    fn free_space_is_short_below_the_minimum() {
        assert!(!temp_folder_space(0).is_short());
        assert!(!temp_folder_space(1).is_short());
        assert!(temp_folder_space(u64::MAX).is_short());
    }

    #[test]
    fn missing_folder_counts_as_short() {
        let folders = vec![std::env::temp_dir(), "/nowhere/at/all".into()];
        assert!(FreeSpace::new(folders, 1).is_short());
    }
}
