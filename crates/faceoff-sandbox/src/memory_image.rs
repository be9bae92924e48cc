//! The runtimes' files, copied into memory once, so that they have nothing to tell.
//!
//! Agents share these files. On a disk each leaves traces in what the kernel keeps of them: the pages that
//! it read, the names that it looked up, and another finds out by the time that the same costs it. Of a
//! file system in memory all pages and all names are there at all times.

use crate::{
    Runtime, RuntimeFiles, SandboxError, bubblewrap::mount_order, error::IoContext, owner::Owner,
    runtime::inside,
};
use rustix::fs::{StatVfs, statvfs};
use std::{
    collections::BTreeMap,
    fs, io,
    os::unix::fs::{PermissionsExt, symlink},
    path::{Path, PathBuf},
};

/// A file system in memory that every Linux host has.
pub const MEMORY: &str = "/dev/shm";
/// Images begin with this.
pub(crate) const IMAGE_PREFIX: &str = "faceoff-runtime-";
/// What a file takes at least.
const PAGE_BYTES: u64 = 4096;

/// The copy, for as long as this lives.
#[derive(Debug)]
pub struct MemoryImage {
    folder: tempfile::TempDir,
    pub bytes: u64,
}

/// Why there is none. Agents then use the host's files.
#[derive(Debug, thiserror::Error)]
pub enum NoImage {
    /// The files are larger than was allowed.
    #[error("the runtimes' files are larger than {limit_bytes} bytes")]
    TooLarge {
        limit_bytes: u64,
    },
    /// The host's memory is smaller.
    #[error("the runtimes' files have {bytes} bytes, and {MEMORY} has room for {free_bytes}")]
    NoRoom {
        bytes: u64,
        free_bytes: u64,
    },
    /// The files could not be read or written.
    #[error(transparent)]
    Failed(#[from] SandboxError),
}

impl MemoryImage {
    /// Copies the files of all `runtimes`, at most `limit_bytes`, and has agents use the copy.
    ///
    /// # Errors
    /// [`NoImage`]; nothing has changed then.
    pub fn make(
        runtimes: &mut BTreeMap<String, Runtime>,
        limit_bytes: u64,
    ) -> Result<Self, NoImage> {
        let bytes = Self::size(runtimes, limit_bytes)?;
        let folder = tempfile::Builder::new()
            .prefix(&Owner::this_process().name(IMAGE_PREFIX))
            .tempdir_in(MEMORY)
            .context("cannot make a folder in memory")?;
        for path in paths(runtimes) {
            let place = inside(folder.path(), &path);
            let copied = fs::create_dir_all(place.parent().unwrap_or(folder.path()))
                .and_then(|()| copy(&path, &place));
            copied.context(format_args!("cannot copy {} into memory", path.display()))?;
        }
        for runtime in runtimes.values_mut() {
            if runtime.root().is_none() {
                runtime.files = RuntimeFiles::Copy(folder.path().to_owned());
            }
        }
        Ok(Self { folder, bytes })
    }

    /// What the copy would take, in bytes.
    ///
    /// # Errors
    /// [`NoImage`], as [`Self::make`] would say.
    pub fn size(runtimes: &BTreeMap<String, Runtime>, limit_bytes: u64) -> Result<u64, NoImage> {
        let mut bytes = 0;
        for path in paths(runtimes) {
            add_size(&path, limit_bytes, &mut bytes)
                .context(format_args!("cannot look into {}", path.display()))?;
        }
        let StatVfs {
            f_bavail, f_frsize, ..
        } = statvfs(MEMORY).context(format_args!("cannot look at {MEMORY}"))?;
        let free_bytes = f_bavail.saturating_mul(f_frsize);
        if bytes > limit_bytes {
            Err(NoImage::TooLarge { limit_bytes })
        } else if bytes > free_bytes {
            Err(NoImage::NoRoom { bytes, free_bytes })
        } else {
            Ok(bytes)
        }
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// All paths of all runtimes, none inside another.
fn paths(runtimes: &BTreeMap<String, Runtime>) -> Vec<PathBuf> {
    let all = runtimes.values().flat_map(|one| &one.read_only_paths);
    mount_order(&all.cloned().collect::<Vec<_>>())
}

/// Adds what is below `path`, until it is more than `limit_bytes`.
fn add_size(path: &Path, limit_bytes: u64, bytes: &mut u64) -> io::Result<()> {
    let Some(meta) = readable(fs::symlink_metadata(path))? else {
        return Ok(());
    };
    *bytes += meta.len().next_multiple_of(PAGE_BYTES);
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

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    let Some(meta) = readable(fs::symlink_metadata(from))? else {
        return Ok(());
    };
    if meta.is_symlink() {
        return symlink(fs::read_link(from)?, to);
    }
    if meta.is_file() {
        return readable(fs::copy(from, to)).map(drop);
    }
    if !meta.is_dir() {
        return Ok(());
    }
    fs::create_dir_all(to)?;
    for entry in readable(fs::read_dir(from))?.into_iter().flatten() {
        let entry = entry?;
        copy(&entry.path(), &to.join(entry.file_name()))?;
    }
    fs::set_permissions(
        to,
        fs::Permissions::from_mode(meta.permissions().mode() | 0o700),
    )
}

/// What is missing, or is closed to us, is so for agents as well.
fn readable<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied
            ) =>
        {
            Ok(None)
        }
        found => found.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_holds_what_the_runtimes_show_and_goes_with_its_owner() {
        let host = tempfile::tempdir().unwrap();
        let at = |name: &str| host.path().join(name);
        fs::create_dir_all(at("lib/inner")).unwrap();
        fs::write(at("lib/inner/file"), "content").unwrap();
        fs::set_permissions(at("lib/inner/file"), fs::Permissions::from_mode(0o755)).unwrap();
        symlink("inner/file", at("lib/link")).unwrap();
        fs::write(at("program"), vec![1; 5000]).unwrap();
        let runtime = |paths: &[&str]| Runtime {
            read_only_paths: paths.iter().map(|path| at(path)).collect(),
            path: String::new(),
            files: RuntimeFiles::Host,
        };
        let mut runtimes = BTreeMap::from([
            ("one".to_owned(), runtime(&["lib", "absent"])),
            ("two".to_owned(), runtime(&["lib", "lib/inner", "program"])),
        ]);
        let refused = MemoryImage::make(&mut runtimes, 8000).unwrap_err();
        assert!(matches!(refused, NoImage::TooLarge { limit_bytes: 8000 }));
        assert_eq!(runtimes["one"].files, RuntimeFiles::Host);

        let image = MemoryImage::make(&mut runtimes, 1 << 20).unwrap();
        assert!((12_000..100_000).contains(&image.bytes), "{}", image.bytes);
        let folder = image.folder().to_owned();
        assert_eq!(runtimes["two"].files, RuntimeFiles::Copy(folder.clone()));
        let copied = |name: &str| inside(&folder, &at(name));
        assert_eq!(fs::read_to_string(copied("lib/link")).unwrap(), "content");
        assert_eq!(
            fs::read_link(copied("lib/link")).unwrap(),
            Path::new("inner/file")
        );
        let mode = fs::metadata(copied("lib/inner/file"))
            .unwrap()
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o755);
        assert_eq!(fs::metadata(copied("program")).unwrap().len(), 5000);
        drop(image);
        assert!(!folder.exists());
    }
}
