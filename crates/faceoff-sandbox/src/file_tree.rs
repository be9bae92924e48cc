//! Copies of files and folders in a file system in memory, and the size of such copies.

use rustix::fs::{AtFlags, CWD, Timespec, Timestamps, utimensat};
use std::{
    fs, io,
    os::unix::fs::{MetadataExt, PermissionsExt, symlink},
    path::Path,
};

/// Memory is allocated in pages of this size.
const PAGE_BYTES: u64 = 4096;

/// Adds the size that copies of the files below `path` would have in memory to `bytes`. Stops once the sum exceeds `limit_bytes`.
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

/// Copies files, folders and links, with their modes and times of change (Python, for one, compares them with those in its compiled
/// files), in the order of their names. The folder `target` may exist.
pub(crate) fn copy(source: &Path, target: &Path) -> io::Result<()> {
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
            copy(&source.join(&name), &target.join(&name))?;
        }
        let mode = meta.permissions().mode() | 0o700;
        fs::set_permissions(target, fs::Permissions::from_mode(mode))?;
    } else {
        return Ok(());
    }
    let time = Timespec {
        tv_sec: meta.mtime(),
        tv_nsec: meta.mtime_nsec(),
    };
    let times = Timestamps {
        last_access: time,
        last_modification: time,
    };
    utimensat(CWD, target, &times, AtFlags::SYMLINK_NOFOLLOW)?;
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
