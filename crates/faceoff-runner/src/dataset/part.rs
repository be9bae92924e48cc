use bytes::Bytes;
use parquet::{
    errors::{ParquetError, Result},
    file::reader::{ChunkReader, Length},
};
use std::{
    fs::File,
    io::{self, BufReader, Read},
    os::unix::fs::FileExt,
    sync::Arc,
};

/// A range of a file: a table on its own, or one inside of an archive.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub file: Arc<File>,
    pub start: u64,
    pub bytes: u64,
}

/// Reads a part from some place on, without moving the file's own position.
pub(crate) struct PartReader {
    part: Part,
    at: u64,
}

impl Part {
    pub fn reader(&self, at: u64) -> PartReader {
        PartReader {
            part: self.clone(),
            at,
        }
    }
}

impl Read for PartReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let left = self.part.bytes.saturating_sub(self.at);
        let wanted = out.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        let read = self
            .part
            .file
            .read_at(&mut out[..wanted], self.part.start + self.at)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Length for Part {
    fn len(&self) -> u64 {
        self.bytes
    }
}

impl ChunkReader for Part {
    type T = BufReader<PartReader>;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        Ok(BufReader::new(self.reader(start)))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
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
