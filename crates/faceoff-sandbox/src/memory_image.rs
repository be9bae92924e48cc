//! A copy of the runtimes' files in memory, which closes a covert channel between agents. It has nothing to do with container images.
//!
//! Agents share these files. On a disk, an agent leaves traces in the kernel's caches: the pages that it read and
//! the names that it looked up. Another agent can find them by timing its own accesses. In a file system in memory,
//! all pages and names are cached at all times.

use crate::{
    Runtime, RuntimeFiles, SandboxError, bubblewrap::mount_order, error::IoContext, file_tree,
    owner::Owner, runtime::path_in_copy,
};
use rustix::fs::{StatVfs, statvfs};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// A file system in memory that every Linux host has.
pub const MEMORY_FOLDER: &str = "/dev/shm";
/// Prefix of the image folders.
pub(crate) const IMAGE_PREFIX: &str = "faceoff-runtime-";

/// A copy of the runtimes' files in memory; removed on drop.
#[derive(Debug)]
pub struct MemoryImage {
    folder: tempfile::TempDir,
    /// Size in bytes.
    pub bytes: u64,
}

/// Failure to create an image. Agents then use the host's files.
#[derive(Debug, thiserror::Error)]
pub enum MemoryImageError {
    /// The files exceed the allowed size.
    #[error("the runtimes' files are larger than {limit_bytes} bytes")]
    TooLarge { limit_bytes: u64 },
    /// The host has too little free memory.
    #[error(
        "the runtimes' files have {bytes} bytes, and {MEMORY_FOLDER} has {free_bytes} bytes free"
    )]
    NotEnoughMemory { bytes: u64, free_bytes: u64 },
    /// The files could not be read or written.
    #[error(transparent)]
    Failed(#[from] SandboxError),
}

impl MemoryImage {
    /// Copies the files of all `runtimes`, at most `limit_bytes`, and makes the runtimes refer to the copy.
    ///
    /// # Errors
    /// [`MemoryImageError`]; nothing has changed then.
    pub fn make(
        runtimes: &mut BTreeMap<String, Runtime>,
        limit_bytes: u64,
    ) -> Result<Self, MemoryImageError> {
        let bytes = Self::size(runtimes, limit_bytes)?;
        let folder = tempfile::Builder::new()
            .prefix(&Owner::this_process().name_prefix(IMAGE_PREFIX))
            .tempdir_in(MEMORY_FOLDER)
            .context("cannot make a folder in memory")?;
        for path in paths(runtimes) {
            let target = path_in_copy(folder.path(), &path);
            let copied = fs::create_dir_all(target.parent().unwrap_or(folder.path()))
                .and_then(|()| file_tree::copy(&path, &target));
            copied.context(format_args!("cannot copy {} into memory", path.display()))?;
        }
        for runtime in runtimes.values_mut() {
            if runtime.root().is_none() {
                runtime.files = RuntimeFiles::Copy(folder.path().to_owned());
            }
        }
        Ok(Self { folder, bytes })
    }

    /// Size of the copy, in bytes, without making it.
    ///
    /// # Errors
    /// [`MemoryImageError`], as [`Self::make`] would say.
    pub fn size(
        runtimes: &BTreeMap<String, Runtime>,
        limit_bytes: u64,
    ) -> Result<u64, MemoryImageError> {
        let mut bytes = 0;
        for path in paths(runtimes) {
            file_tree::add_size(&path, limit_bytes, &mut bytes)
                .context(format_args!("cannot look into {}", path.display()))?;
        }
        let StatVfs {
            f_bavail, f_frsize, ..
        } = statvfs(MEMORY_FOLDER).context(format_args!("cannot look at {MEMORY_FOLDER}"))?;
        let free_bytes = f_bavail.saturating_mul(f_frsize);
        if bytes > limit_bytes {
            Err(MemoryImageError::TooLarge { limit_bytes })
        } else if bytes > free_bytes {
            Err(MemoryImageError::NotEnoughMemory { bytes, free_bytes })
        } else {
            Ok(bytes)
        }
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// All paths of all runtimes, without paths inside others.
fn paths(runtimes: &BTreeMap<String, Runtime>) -> Vec<PathBuf> {
    let all = runtimes.values().flat_map(|one| &one.read_only_paths);
    mount_order(&all.cloned().collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    #[test]
    fn memory_image_copies_files_and_is_removed_on_drop() {
        let host = tempfile::tempdir().unwrap();
        let path_of = |name: &str| host.path().join(name);
        fs::create_dir_all(path_of("lib/inner")).unwrap();
        fs::write(path_of("lib/inner/file"), "content").unwrap();
        fs::set_permissions(path_of("lib/inner/file"), fs::Permissions::from_mode(0o755)).unwrap();
        symlink("inner/file", path_of("lib/link")).unwrap();
        fs::write(path_of("program"), vec![1; 5000]).unwrap();
        let runtime = |paths: &[&str]| Runtime {
            read_only_paths: paths.iter().map(|path| path_of(path)).collect(),
            path: String::new(),
            files: RuntimeFiles::Host,
        };
        let mut runtimes = BTreeMap::from([
            ("one".to_owned(), runtime(&["lib", "absent"])),
            ("two".to_owned(), runtime(&["lib", "lib/inner", "program"])),
        ]);
        let refused = MemoryImage::make(&mut runtimes, 8000).unwrap_err();
        assert!(matches!(
            refused,
            MemoryImageError::TooLarge { limit_bytes: 8000 }
        ));
        assert_eq!(runtimes["one"].files, RuntimeFiles::Host);

        let image = MemoryImage::make(&mut runtimes, 1 << 20).unwrap();
        assert!((12_000..100_000).contains(&image.bytes), "{}", image.bytes);
        let folder = image.folder().to_owned();
        assert_eq!(runtimes["two"].files, RuntimeFiles::Copy(folder.clone()));
        let copy_of = |name: &str| path_in_copy(&folder, &path_of(name));
        assert_eq!(fs::read_to_string(copy_of("lib/link")).unwrap(), "content");
        assert_eq!(
            fs::read_link(copy_of("lib/link")).unwrap(),
            Path::new("inner/file")
        );
        let mode = fs::metadata(copy_of("lib/inner/file"))
            .unwrap()
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o755);
        let modified_at = |path: &Path| {
            let meta = fs::metadata(path).unwrap();
            (meta.mtime(), meta.mtime_nsec())
        };
        for name in ["lib", "lib/inner/file", "program"] {
            assert_eq!(
                modified_at(&copy_of(name)),
                modified_at(&path_of(name)),
                "{name}: compiled Python files contain the times of their sources"
            );
        }
        assert_eq!(fs::metadata(copy_of("program")).unwrap().len(), 5000);
        drop(image);
        assert!(!folder.exists());
    }
}
