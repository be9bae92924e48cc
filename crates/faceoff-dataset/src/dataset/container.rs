//! The place of a dataset's files: a folder, or a zip archive.

use super::{
    file_range::{FileRange, open},
    seal::{self, Seal},
};
use crate::{
    digest,
    error::DatasetError,
    files::{MANIFEST_FILE, RESULTS_FILE, max_json_bytes},
};
use faceoff_wire::dataset::FileDigest;
use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};
use zip::{CompressionMethod, ZipArchive};

/// The folder or archive of a dataset's files.
#[derive(Debug)]
pub(crate) enum Container {
    Folder(PathBuf),
    Archive {
        zip: Mutex<ZipArchive<File>>,
        file: Arc<File>,
    },
}

impl Container {
    pub fn archive(path: &Path) -> Result<Self, DatasetError> {
        let file = open(path)?;
        let zip =
            ZipArchive::new(file.try_clone()?).map_err(DatasetError::unreadable(path.display()))?;
        Ok(Self::Archive {
            zip: Mutex::new(zip),
            file: Arc::new(file),
        })
    }

    /// Checks the seal of an archive of layout 2. Archives repacked by other programs have none; their files are
    /// checked anyway.
    pub fn check_seal(&self) -> Result<(), DatasetError> {
        let Self::Archive { zip, file } = self else {
            return Ok(());
        };
        let altered = |problem: &str| Err(DatasetError::Altered(problem.to_owned()));
        match seal::check(file)? {
            Seal::Intact => Ok(()),
            Seal::Broken => altered("the archive's bytes do not match its seal; download it again"),
            Seal::Absent => {
                let zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                if zip.comment().is_empty() {
                    Ok(())
                } else {
                    altered("the archive's comment is not a seal")
                }
            }
        }
    }

    /// Checks that an archive holds exactly these files and the manifest, each once.
    pub fn expect_only(&self, names: &[&str]) -> Result<(), DatasetError> {
        let Self::Archive { zip, .. } = self else {
            // A folder may hold other files too.
            return Ok(());
        };
        let zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
        for name in zip.file_names() {
            let name = name.map_err(DatasetError::unreadable("a file's name"))?;
            if name != MANIFEST_FILE && !names.contains(&&*name) {
                return Err(DatasetError::Altered(format!(
                    "the archive holds {name:?}, which the manifest does not list"
                )));
            }
        }
        if zip.len() != names.len() + 1 {
            return Err(DatasetError::Unreadable(format!(
                "the archive holds {} files, expected {}",
                zip.len(),
                names.len() + 1
            )));
        }
        Ok(())
    }

    /// Reads a file into memory, of bounded size. Tables are read in parts and are not bounded.
    pub fn bytes(&self, name: &str) -> Result<Vec<u8>, DatasetError> {
        let max_bytes = max_json_bytes(name);
        let mut bytes = Vec::new();
        self.read(name, |reader| {
            reader.take(max_bytes + 1).read_to_end(&mut bytes)
        })?;
        if bytes.len() as u64 > max_bytes {
            return Err(DatasetError::Unreadable(format!(
                "{name} is larger than {max_bytes} bytes, more than any dataset needs"
            )));
        }
        Ok(bytes)
    }

    /// Checks that a `results.json` beside the archive, if there is one, equals the one inside. `archive_name` is for the error.
    pub fn check_results_copy(&self, path: &Path, archive_name: &str) -> Result<(), DatasetError> {
        if !path.try_exists()? {
            return Ok(());
        }
        let inside = self.bytes(RESULTS_FILE)?;
        let mut copy = Vec::new();
        open(path)?
            .take(inside.len() as u64 + 1)
            .read_to_end(&mut copy)?;
        if copy == inside {
            return Ok(());
        }
        Err(DatasetError::Altered(format!(
            "{} is not the {RESULTS_FILE} in {archive_name}",
            path.display()
        )))
    }

    /// Size and hash of a file, streamed.
    pub fn digest(&self, name: &str) -> Result<FileDigest, DatasetError> {
        self.read(name, |reader| digest::of_reader(reader))
    }

    /// The part of the container with a file's bytes, for random access.
    pub fn range(&self, name: &str) -> Result<FileRange, DatasetError> {
        match self {
            Self::Folder(dir) => FileRange::whole(&dir.join(name)),
            Self::Archive { zip, file } => {
                let mut zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                let entry = zip.by_name(name).map_err(DatasetError::unreadable(name))?;
                let (CompressionMethod::Stored, Some(start)) =
                    (entry.compression(), entry.data_start())
                else {
                    return Err(DatasetError::Unreadable(format!(
                        "{name} is compressed in the archive; unpack it and pass the folder"
                    )));
                };
                Ok(FileRange {
                    file: file.clone(),
                    start,
                    // An entry that is not compressed states its size twice. Streamed reads end at the compressed
                    // size, so random access uses it too.
                    bytes: entry.compressed_size(),
                })
            }
        }
    }

    /// Opens a file, and reads it with `read`.
    fn read<T>(
        &self,
        name: &str,
        read: impl FnOnce(&mut dyn Read) -> io::Result<T>,
    ) -> Result<T, DatasetError> {
        match self {
            Self::Folder(dir) => {
                let path = dir.join(name);
                let mut file = open(&path)?;
                let reading =
                    |error| io::Error::other(format!("reading {}: {error}", path.display()));
                Ok(read(&mut file).map_err(reading)?)
            }
            Self::Archive { zip, .. } => {
                let mut zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                let mut entry = zip.by_name(name).map_err(DatasetError::unreadable(name))?;
                read(&mut entry).map_err(|error| match error.raw_os_error() {
                    Some(_) => DatasetError::Io(error),
                    // A wrong checksum of the zip entry, or a stream that does not unpack.
                    None => DatasetError::Altered(format!("{name}: {error}")),
                })
            }
        }
    }
}
