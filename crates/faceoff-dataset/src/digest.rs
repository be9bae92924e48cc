use crate::times::nanoseconds;
use faceoff_episode::AnswerTiming;
use faceoff_wire::dataset::FileDigest;
use std::{
    io::{self, Write},
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

/// Hashes of what an episode's steps were given from outside: the actions, and apart from them the
/// measured times. An action may differ in a bit that moves nothing, and a time follows from nothing;
/// the hashes show both.
#[derive(Debug, Default)]
pub(crate) struct StepDigests {
    actions: blake3::Hasher,
    times: blake3::Hasher,
}

impl StepDigests {
    /// Adds an answered step: the action's numbers as little-endian doubles; the computation time and
    /// the CPU time in nanoseconds as little-endian 64-bit integers, −1 for a CPU time that is not
    /// known, then, if the host took some of the time, −2 and that time.
    pub fn add(&mut self, action: &[f64], answered: &AnswerTiming) {
        for number in action {
            self.actions.update(&number.to_le_bytes());
        }
        let cpu_time_ns = answered.cpu_time_s.map_or(-1, nanoseconds);
        self.times
            .update(&nanoseconds(answered.computation_time_s).to_le_bytes());
        self.times.update(&cpu_time_ns.to_le_bytes());
        let host_time_ns = nanoseconds(answered.host_time_s);
        if host_time_ns != 0 {
            // No computation time is negative: this cannot be taken for the next step's.
            self.times.update(&(-2_i64).to_le_bytes());
            self.times.update(&host_time_ns.to_le_bytes());
        }
    }

    /// Both hashes, of the actions and of the times.
    pub fn finish(&self) -> [String; 2] {
        [&self.actions, &self.times].map(|hasher| hasher.finalize().to_hex().to_string())
    }
}

/// Count and hash of a file, streamed.
pub(crate) fn of_file(path: &Path) -> io::Result<FileDigest> {
    of_reader(&mut fs_err::File::open(path)?)
}

/// Count and hash of all bytes that come.
pub(crate) fn of_reader(reader: &mut dyn io::Read) -> io::Result<FileDigest> {
    let mut hashing = HashingWriter::new(io::sink());
    io::copy(reader, &mut hashing)?;
    Ok(hashing.digest())
}
