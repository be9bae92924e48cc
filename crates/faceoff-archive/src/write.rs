//! Writes an archive of a season to a stream.

use crate::{
    error::ArchiveError,
    manifest::{Entry, MANIFEST_NAME, Manifest},
};
use std::io::{self, Read, Write};

/// Compression level: a low one, since most files are already compressed.
const ZSTD_LEVEL: i32 = 3;

/// Writes an archive's files in the order of its manifest.
pub struct Writer<W: Write> {
    tar: tar::Builder<zstd::Encoder<'static, W>>,
    /// Time of the data, in seconds since 1970: the modification time of all files.
    made_at_s: u64,
    remaining_files: std::vec::IntoIter<Entry>,
}

impl<W: Write> Writer<W> {
    /// Writes the manifest, which lists all files that will follow.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] if the manifest is invalid; [`ArchiveError::Io`].
    pub fn begin(out: W, manifest: &Manifest) -> Result<Self, ArchiveError> {
        manifest.check()?;
        let mut encoder = zstd::Encoder::new(out, ZSTD_LEVEL)?;
        encoder.include_checksum(true)?;
        let mut writer = Self {
            tar: tar::Builder::new(encoder),
            made_at_s: u64::try_from(manifest.made_at.as_second()).unwrap_or(0),
            remaining_files: manifest.files.clone().into_iter(),
        };
        let json = serde_json::to_vec_pretty(manifest).map_err(io::Error::other)?;
        let header = writer.header(MANIFEST_NAME, json.len() as u64)?;
        writer.tar.append(&header, json.as_slice())?;
        Ok(writer)
    }

    /// Writes the next file of the manifest, with the content from `open_content`; returns false after the last one.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] if its content differs from the manifest: the archive is invalid then.
    pub fn next<R: Read>(
        &mut self,
        open_content: impl FnOnce(&Entry) -> io::Result<R>,
    ) -> Result<bool, ArchiveError> {
        let Some(entry) = self.remaining_files.next() else {
            return Ok(false);
        };
        let header = self.header(&entry.path, entry.bytes)?;
        let mut content = open_content(&entry)?;
        let mut reader = HashingReader {
            content: (&mut content).take(entry.bytes),
            hasher: blake3::Hasher::new(),
            bytes: 0,
        };
        self.tar.append(&header, &mut reader)?;
        let (bytes, hash) = (reader.bytes, reader.hasher.finalize().to_string());
        let has_more = content.read(&mut [0])? > 0;
        if bytes != entry.bytes || has_more || hash != entry.blake3 {
            return Err(ArchiveError::Refused(format!(
                "{} differs from the manifest ({} bytes, hash {}): it was changed or is damaged",
                entry.path, entry.bytes, entry.blake3
            )));
        }
        Ok(true)
    }

    /// Completes the archive and returns the underlying writer.
    ///
    /// # Errors
    /// [`ArchiveError::Io`].
    pub fn finish(self) -> Result<W, ArchiveError> {
        debug_assert_eq!(
            self.remaining_files.len(),
            0,
            "all files of the manifest were written"
        );
        Ok(self.tar.into_inner()?.finish()?)
    }

    fn header(&self, path: &str, bytes: u64) -> io::Result<tar::Header> {
        let mut header = tar::Header::new_ustar();
        header.set_path(path)?;
        header.set_size(bytes);
        header.set_mode(0o644);
        header.set_mtime(self.made_at_s);
        header.set_entry_type(tar::EntryType::Regular);
        header.set_cksum();
        Ok(header)
    }
}

/// Counts and hashes the bytes read through it.
struct HashingReader<R> {
    content: R,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.content.read(buffer)?;
        self.hasher.update(&buffer[..read]);
        self.bytes += read as u64;
        Ok(read)
    }
}
