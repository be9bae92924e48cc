//! BLAKE3 hashes of files, and of the recorded actions and times of an episode.

use crate::times::nanoseconds;
use faceoff_episode::AnswerTiming;
use faceoff_wire::dataset::FileDigest;
use std::{
    io::{self, Write},
    path::Path,
};

/// Writes bytes to `inner` and computes their count and hash.
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

    /// Count and hash of the bytes so far.
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

/// Hashes of the external inputs of an episode's steps: one of the actions, one of the measured times. A changed bit
/// of an action may have no effect on the motion, and a time follows from no other number; the hashes detect both.
#[derive(Debug, Default)]
pub(crate) struct StepDigests {
    actions: blake3::Hasher,
    times: blake3::Hasher,
}

impl StepDigests {
    /// Adds an answered step: the action's numbers as little-endian doubles; the computation time and
    /// the CPU time in nanoseconds as little-endian 64-bit integers, −1 for an unknown CPU time; then, if host
    /// interference is not 0, −2 and the interference.
    pub fn add(&mut self, action: &[f64], timing: &AnswerTiming) {
        for number in action {
            self.actions.update(&number.to_le_bytes());
        }
        let cpu_time_ns = timing.cpu_time_s.map_or(-1, nanoseconds);
        self.times
            .update(&nanoseconds(timing.computation_time_s).to_le_bytes());
        self.times.update(&cpu_time_ns.to_le_bytes());
        let host_interference_ns = nanoseconds(timing.host_time_s);
        if host_interference_ns != 0 {
            // Computation times are not negative, so −2 cannot be mistaken for the next step's.
            self.times.update(&(-2_i64).to_le_bytes());
            self.times.update(&host_interference_ns.to_le_bytes());
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

/// Count and hash of all bytes of a reader.
pub(crate) fn of_reader(reader: &mut dyn io::Read) -> io::Result<FileDigest> {
    let mut hashing = HashingWriter::new(io::sink());
    io::copy(reader, &mut hashing)?;
    Ok(hashing.digest())
}
