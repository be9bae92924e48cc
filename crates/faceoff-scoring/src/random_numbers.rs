//! Deterministic random numbers: the same key gives the same numbers.

use faceoff_types::Seed;

/// Random numbers from an endless stream of bytes.
pub(crate) struct RandomNumbers {
    stream: blake3::OutputReader,
    buffer: Box<[u8; Self::BUFFER_BYTES]>,
    /// Bytes of `buffer` that are consumed.
    used: usize,
}

impl RandomNumbers {
    const BUFFER_BYTES: usize = 16 * 1024;

    pub(crate) fn new(stream: blake3::OutputReader) -> Self {
        Self {
            stream,
            buffer: Box::new([0; Self::BUFFER_BYTES]),
            used: Self::BUFFER_BYTES,
        }
    }

    /// The stream keyed with a seed.
    pub(crate) fn from_seed(seed: &Seed) -> Self {
        Self::new(blake3::Hasher::new_keyed(seed.as_bytes()).finalize_xof())
    }

    /// A uniform number below `n`. Its bias of at most n / 2³² is negligible for thousands of resamples.
    pub(crate) fn below(&mut self, n: u32) -> usize {
        if self.used == Self::BUFFER_BYTES {
            self.stream.fill(&mut self.buffer[..]);
            self.used = 0;
        }
        let bytes = &self.buffer[self.used..self.used + 4];
        self.used += 4;
        let draw = u32::from_le_bytes(bytes.try_into().expect("a slice of four bytes"));
        ((u64::from(draw) * u64::from(n)) >> 32) as usize
    }

    /// Shuffles `items` (Fisher and Yates).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let candidates = u32::try_from(last + 1).expect("a list of teams is short");
            items.swap(last, self.below(candidates));
        }
    }
}
