use super::{DatasetError, part::Part};
use crate::{
    recording::{HashingWriter, MANIFEST_FILE},
    seal::{self, Seal},
};
use faceoff_wire::dataset::FileDigest;
use std::{
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};
use zip::{CompressionMethod, ZipArchive};

/// The largest of the files that are read as a whole; the tables are not among them.
const SMALL_FILE_BYTES: u64 = 512 << 20;

/// Where a dataset's files are.
#[derive(Debug)]
pub(super) enum Container {
    Folder(PathBuf),
    Archive {
        zip: Mutex<ZipArchive<File>>,
        file: Arc<File>,
    },
}

impl Container {
    pub fn folder(path: &Path) -> Result<Self, DatasetError> {
        Ok(Self::Folder(path.to_owned()))
    }

    /// Opens an archive and checks its seal. One that others have packed has none; its files are
    /// checked all the same.
    pub fn archive(path: &Path) -> Result<Self, DatasetError> {
        let file = open(path)?;
        let reading = || DatasetError::io(format!("reading {}", path.display()));
        let seal = seal::check(&file).map_err(reading())?;
        if seal == Seal::Broken {
            return Err(DatasetError::Altered(format!(
                "{}: the bytes are not those that its seal covers; download it again",
                path.display()
            )));
        }
        let zip = ZipArchive::new(file.try_clone().map_err(reading())?)
            .map_err(DatasetError::unreadable(path.display().to_string()))?;
        if seal == Seal::Absent && !zip.comment().is_empty() {
            return Err(DatasetError::Altered(format!(
                "{}: the archive's comment is no seal",
                path.display()
            )));
        }
        Ok(Self::Archive {
            zip: Mutex::new(zip),
            file: Arc::new(file),
        })
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
        let mut hashing = HashingWriter::new(io::sink());
        self.read(name, |reader| io::copy(reader, &mut hashing))?;
        Ok(hashing.digest())
    }

    /// A file that can be read from any place.
    pub fn part(&self, name: &str) -> Result<Part, DatasetError> {
        match self {
            Self::Folder(dir) => {
                let path = dir.join(name);
                let file = open(&path)?;
                let bytes = file
                    .metadata()
                    .map_err(DatasetError::io(format!("reading {}", path.display())))?
                    .len();
                Ok(Part {
                    file: Arc::new(file),
                    start: 0,
                    bytes,
                })
            }
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
                Ok(Part {
                    file: file.clone(),
                    start,
                    bytes: entry.size(),
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
                read(&mut open(&path)?)
                    .map_err(DatasetError::io(format!("reading {}", path.display())))
            }
            Self::Archive { zip, .. } => {
                let mut zip = zip.lock().unwrap_or_else(PoisonError::into_inner);
                let mut entry = zip.by_name(name).map_err(DatasetError::unreadable(name))?;
                // A wrong checksum or a broken stream is an error of reading.
                read(&mut entry).map_err(DatasetError::unreadable(name))
            }
        }
    }
}

fn open(path: &Path) -> Result<File, DatasetError> {
    let opening = || DatasetError::io(format!("opening {}", path.display()));
    // Asked before it is opened: opening a pipe would wait for its writer.
    if !fs::metadata(path).map_err(opening())?.is_file() {
        return Err(DatasetError::Unreadable(format!(
            "{} is no file",
            path.display()
        )));
    }
    File::open(path).map_err(opening())
}
