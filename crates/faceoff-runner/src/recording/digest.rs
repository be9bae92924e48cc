use crate::PlatformFault;
use faceoff_wire::dataset::FileDigest;
use std::{
    fs::File,
    io::{self, Read, Write},
    path::Path,
};

/// Passes bytes on and keeps their count and hash.
pub(crate) struct HashingWriter<W> {
    inner: W,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<W> HashingWriter<W> {
    pub fn new(inner: W) -> Self {
        Self {
            inner,
            hasher: blake3::Hasher::new(),
            bytes: 0,
        }
    }

    /// Count and hash of what passed.
    pub fn digest(&self) -> FileDigest {
        FileDigest {
            bytes: self.bytes,
            blake3: self.hasher.finalize().to_hex().to_string(),
        }
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Count and hash of a file, streamed.
pub(super) fn of_file(path: &Path) -> Result<FileDigest, PlatformFault> {
    let reading = || PlatformFault::io(format!("reading {}", path.display()));
    let mut file = File::open(path).map_err(reading())?;
    let mut hashing = HashingWriter::new(io::sink());
    let mut buffer = vec![0; 128 << 10];
    loop {
        match file.read(&mut buffer).map_err(reading())? {
            0 => return Ok(hashing.digest()),
            read => hashing.write_all(&buffer[..read]).map_err(reading())?,
        }
    }
}
