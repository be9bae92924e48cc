use super::{
    file_range::{FileRange, open},
    seal::{self, Seal},
};
use crate::{digest, error::DatasetError, files::MANIFEST_FILE};
use faceoff_wire::dataset::FileDigest;
use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};
use zip::{CompressionMethod, ZipArchive};

/// The largest of the files that are read as a whole; the tables are not among them.
const SMALL_FILE_BYTES: u64 = 512 << 20;

/// Where a dataset's files are.
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

    /// Checks an archive's seal, as layout 2 has it. One that others have packed has none; its files are
    /// checked all the same.
    pub fn check_seal(&self) -> Result<(), DatasetError> {
        let Self::Archive { zip, file } = self else {
            return Ok(());
        };
        let altered = |what: &str| Err(DatasetError::Altered(what.to_owned()));
        match seal::check(file)? {
            Seal::Intact => Ok(()),
            Seal::Broken => {
                altered("the bytes are not those that the archive's seal covers; download it again")
            }
            Seal::Absent => {
                let zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                if zip.comment().is_empty() {
                    Ok(())
                } else {
                    altered("the archive's comment is no seal")
                }
            }
        }
    }

    /// There is no file but these and the manifest; each is there once.
    pub fn expect_only(&self, names: &[&str]) -> Result<(), DatasetError> {
        let Self::Archive { zip, .. } = self else {
            // A folder may hold whatever its owner puts there.
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

    /// A file as a whole.
    pub fn bytes(&self, name: &str) -> Result<Vec<u8>, DatasetError> {
        let mut bytes = Vec::new();
        self.read(name, |reader| {
            reader.take(SMALL_FILE_BYTES + 1).read_to_end(&mut bytes)
        })?;
        if bytes.len() as u64 > SMALL_FILE_BYTES {
            return Err(DatasetError::Unreadable(format!(
                "{name} is larger than {SMALL_FILE_BYTES} bytes"
            )));
        }
        Ok(bytes)
    }

    /// Size and hash of a file, streamed.
    pub fn digest(&self, name: &str) -> Result<FileDigest, DatasetError> {
        self.read(name, |reader| digest::of_reader(reader))
    }

    /// A file that can be read from any place.
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
                        "{name} is compressed inside of the archive; unpack it and name the folder"
                    )));
                };
                Ok(FileRange {
                    file: file.clone(),
                    start,
                    // Of the two sizes that a zip states, the one by which streams are read, too.
                    bytes: entry.compressed_size(),
                })
            }
        }
    }

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
                    // The zip's own checksum, or a stream that no longer unpacks.
                    None => DatasetError::Altered(format!("{name}: {error}")),
                })
            }
        }
    }
}
