//! Writes the zip archive of a dataset or of a recorded game, and hashes its files on the way.

use crate::{digest::HashingWriter, error::RecordingError, score::json_file};
use faceoff_wire::dataset::FileDigest;
use fs_err::File;
use serde::Serialize;
use std::{
    collections::BTreeMap,
    io::{BufWriter, Write},
    path::Path,
};
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

/// The writer of one file in the archive.
pub(crate) type Entry<'a> = HashingWriter<&'a mut ZipWriter<BufWriter<File>>>;

/// Writes a zip archive and records sizes and hashes of its files.
pub(crate) struct ArchiveWriter {
    zip: ZipWriter<BufWriter<File>>,
    files: BTreeMap<String, FileDigest>,
}

impl ArchiveWriter {
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let out = BufWriter::with_capacity(128 << 10, File::create(path)?);
        Ok(Self {
            zip: ZipWriter::new(out),
            files: BTreeMap::new(),
        })
    }

    /// Sizes and hashes of the added files.
    pub const fn files(&self) -> &BTreeMap<String, FileDigest> {
        &self.files
    }

    /// Adds a file; `write` writes its bytes.
    pub fn add(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut Entry<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        // Parquet is already compressed and is read in place. No time is stored, so that the same contents
        // give the same bytes.
        let method = if name.ends_with(".parquet") {
            CompressionMethod::Stored
        } else {
            CompressionMethod::Deflated
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .large_file(true);
        self.zip
            .start_file(name, options)
            .map_err(RecordingError::unusable(format!(
                "adding {name} to the archive"
            )))?;
        let mut out = HashingWriter::new(&mut self.zip);
        write(&mut out)?;
        self.files.insert(name.to_owned(), out.digest());
        Ok(())
    }

    pub fn add_json<T: Serialize>(&mut self, name: &str, value: &T) -> Result<(), RecordingError> {
        let bytes = json_file(value).map_err(RecordingError::unusable(name))?;
        self.add(name, |out| Ok(out.write_all(&bytes)?))
    }

    /// Completes the archive and waits until it is on the disk.
    pub fn finish(self) -> Result<(), RecordingError> {
        let mut buffered = self
            .zip
            .finish()
            .map_err(RecordingError::unusable("closing the archive"))?;
        buffered.flush()?;
        Ok(buffered.get_ref().sync_all()?)
    }
}
