//! Copies of files and folders in memory.

use rustix::fs::{AtFlags, CWD, Timespec, Timestamps, utimensat};
use std::{
    fs::{self, Metadata},
    io,
    os::unix::fs::{MetadataExt, PermissionsExt, symlink},
    path::Path,
};

/// Memory is allocated in pages of this size.
const PAGE_BYTES: u64 = 4096;
/// The fixed time of files: 2000-01-01 00:00 UTC, in seconds since 1970.
const FIXED_TIME_S: i64 = 946_684_800;

/// Modification times of the copies.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Times {
    /// Those of the originals. Python, for one, compares them with those in its compiled files.
    Original,
    /// The same for all files.
    Fixed,
}

impl Times {
    fn of(self, original: &Metadata) -> Timestamps {
        let (tv_sec, tv_nsec) = match self {
            Self::Original => (original.mtime(), original.mtime_nsec()),
            Self::Fixed => (FIXED_TIME_S, 0),
        };
        let time = Timespec { tv_sec, tv_nsec };
        Timestamps {
            last_access: time,
            last_modification: time,
        }
    }
}

/// Adds the size of the files below `path`, in memory; stops once the sum exceeds `limit_bytes`.
pub(crate) fn add_size(path: &Path, limit_bytes: u64, bytes: &mut u64) -> io::Result<()> {
    let Some(meta) = readable(fs::symlink_metadata(path))? else {
        return Ok(());
    };
    // An empty file takes memory for itself.
    *bytes += meta.len().max(1).next_multiple_of(PAGE_BYTES);
    if meta.is_dir() {
        for entry in readable(fs::read_dir(path))?.into_iter().flatten() {
            if *bytes > limit_bytes {
                break;
            }
            add_size(&entry?.path(), limit_bytes, bytes)?;
        }
    }
    Ok(())
}

/// Copies files, folders and links, with their modes, in the order of their names. The folder `target` may exist.
pub(crate) fn copy(source: &Path, target: &Path, times: Times) -> io::Result<()> {
    let Some(meta) = readable(fs::symlink_metadata(source))? else {
        return Ok(());
    };
    if meta.is_symlink() {
        symlink(fs::read_link(source)?, target)?;
    } else if meta.is_file() {
        if readable(fs::copy(source, target))?.is_none() {
            return Ok(());
        }
    } else if meta.is_dir() {
        fs::create_dir_all(target)?;
        let mut names = Vec::new();
        for entry in readable(fs::read_dir(source))?.into_iter().flatten() {
            names.push(entry?.file_name());
        }
        names.sort_unstable();
        for name in names {
            copy(&source.join(&name), &target.join(&name), times)?;
        }
        let mode = meta.permissions().mode() | 0o700;
        fs::set_permissions(target, fs::Permissions::from_mode(mode))?;
    } else {
        return Ok(());
    }
    utimensat(CWD, target, &times.of(&meta), AtFlags::SYMLINK_NOFOLLOW)?;
    Ok(())
}

/// `None` for missing and unreadable files: agents cannot read them either.
fn readable<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied
            ) =>
        {
            Ok(None)
        }
        result => result.map(Some),
    }
}
