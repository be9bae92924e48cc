//! A range of a file that the Parquet library reads as if it were a whole file: a table within an archive is not unpacked.

use crate::error::DatasetError;
use bytes::Bytes;
use parquet::{
    errors::ParquetError,
    file::reader::{ChunkReader, Length},
};
use std::{
    fs::File,
    io::{self, BufReader, Read},
    os::unix::fs::FileExt,
    path::Path,
    sync::Arc,
};

/// A range of a file: a table, or the part of an archive that is a table.
#[derive(Debug, Clone)]
pub(crate) struct FileRange {
    pub file: Arc<File>,
    /// Offset of the range in the file.
    pub start: u64,
    /// Length of the range.
    pub bytes: u64,
}

/// Reads a range from an offset, without moving the file's position.
pub(crate) struct FileRangeReader {
    range: FileRange,
    /// Offset of the next byte from the start of the range.
    position: u64,
}

/// Opens a regular file; refuses everything else.
pub(super) fn open(path: &Path) -> Result<File, DatasetError> {
    // Check before opening: opening a pipe would wait for its writer.
    if !fs_err::metadata(path)?.is_file() {
        return Err(DatasetError::Unreadable(format!(
            "{} is not a file",
            path.display()
        )));
    }
    Ok(fs_err::File::open(path)?.into_file())
}

impl FileRange {
    /// The range of a whole file.
    pub fn whole(path: &Path) -> Result<Self, DatasetError> {
        let file = open(path)?;
        let bytes = file.metadata()?.len();
        Ok(Self {
            file: Arc::new(file),
            start: 0,
            bytes,
        })
    }

    pub fn reader(&self, position: u64) -> FileRangeReader {
        FileRangeReader {
            range: self.clone(),
            position,
        }
    }
}

impl Read for FileRangeReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let remaining = self.range.bytes.saturating_sub(self.position);
        let length = out
            .len()
            .min(usize::try_from(remaining).unwrap_or(usize::MAX));
        let read = self
            .range
            .file
            .read_at(&mut out[..length], self.range.start + self.position)?;
        self.position += read as u64;
        Ok(read)
    }
}

impl Length for FileRange {
    fn len(&self) -> u64 {
        self.bytes
    }
}

impl ChunkReader for FileRange {
    type T = BufReader<FileRangeReader>;

    fn get_read(&self, start: u64) -> parquet::errors::Result<Self::T> {
        Ok(BufReader::new(self.reader(start)))
    }

    fn get_bytes(&self, start: u64, length: usize) -> parquet::errors::Result<Bytes> {
        if start
            .checked_add(length as u64)
            .is_none_or(|end| end > self.bytes)
        {
            return Err(ParquetError::EOF(format!(
                "bytes {start} and {length} more of a table of {} bytes",
                self.bytes
            )));
        }
        let mut bytes = vec![0; length];
        self.file
            .read_exact_at(&mut bytes, self.start + start)
            .map_err(|error| ParquetError::External(Box::new(error)))?;
        Ok(bytes.into())
    }
}
