//! Making an archive, piece by piece.

use crate::{
    error::ArchiveError,
    manifest::{Entry, MANIFEST_NAME, Manifest},
};
use std::io::{self, Read, Write};

/// Most of an archive is compressed already.
const LEVEL: i32 = 3;

/// Writes an archive's files in the order of its manifest.
pub struct Writer<W: Write> {
    tar: tar::Builder<zstd::Encoder<'static, W>>,
    made_at_s: u64,
    left: std::vec::IntoIter<Entry>,
}

impl<W: Write> Writer<W> {
    /// Begins with the manifest, which names all that will follow.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] if the manifest breaks its own rules; [`ArchiveError::Io`].
    pub fn begin(out: W, manifest: &Manifest) -> Result<Self, ArchiveError> {
        manifest.check()?;
        let mut encoder = zstd::Encoder::new(out, LEVEL)?;
        encoder.include_checksum(true)?;
        let mut writer = Self {
            tar: tar::Builder::new(encoder),
            made_at_s: u64::try_from(manifest.made_at.as_second()).unwrap_or(0),
            left: manifest.files.clone().into_iter(),
        };
        let json = serde_json::to_vec_pretty(manifest).map_err(io::Error::other)?;
        let header = writer.header(MANIFEST_NAME, json.len() as u64)?;
        writer.tar.append(&header, json.as_slice())?;
        Ok(writer)
    }

    /// The next file of the manifest, which `open` is asked for by its entry; false after the last one.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] if its content is not what the manifest says: the archive is worth nothing then.
    pub fn next<R: Read>(
        &mut self,
        open: impl FnOnce(&Entry) -> io::Result<R>,
    ) -> Result<bool, ArchiveError> {
        let Some(entry) = self.left.next() else {
            return Ok(false);
        };
        let header = self.header(&entry.path, entry.bytes)?;
        let mut content = open(&entry)?;
        let mut hashed = Hashed {
            content: (&mut content).take(entry.bytes),
            hasher: blake3::Hasher::new(),
            bytes: 0,
        };
        self.tar.append(&header, &mut hashed)?;
        let (bytes, hash) = (hashed.bytes, hashed.hasher.finalize().to_string());
        let goes_on = content.read(&mut [0])? > 0;
        if bytes != entry.bytes || goes_on || hash != entry.blake3 {
            return Err(ArchiveError::Refused(format!(
                "{} is not what it was when its hash was taken ({} bytes, {}): it was changed or is damaged",
                entry.path, entry.bytes, entry.blake3
            )));
        }
        Ok(true)
    }

    /// Ends the archive and gives back what it was written to.
    ///
    /// # Errors
    /// [`ArchiveError::Io`].
    pub fn finish(self) -> Result<W, ArchiveError> {
        debug_assert_eq!(self.left.len(), 0, "all files of the manifest were written");
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

/// Counts and hashes what is read through it.
struct Hashed<R> {
    content: R,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.content.read(buffer)?;
        self.hasher.update(&buffer[..read]);
        self.bytes += read as u64;
        Ok(read)
    }
}
