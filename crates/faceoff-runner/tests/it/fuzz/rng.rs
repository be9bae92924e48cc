//! The random numbers of a fuzz run, determined by its seed.

/// The generator SplitMix64, with its constants: good enough to choose mutations.
pub struct Rng(u64);

impl Rng {
    /// The generator of one run.
    pub fn new(target: &str, seed: u64, run: u64) -> Self {
        let mut rng = Self(seed);
        for byte in target.bytes().chain(run.to_le_bytes()) {
            rng.0 = rng.0.wrapping_add(u64::from(byte));
            rng.0 = rng.bits();
        }
        rng
    }

    /// The next 64 random bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// A number below `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        let end = u64::try_from(end.max(1)).unwrap();
        usize::try_from(self.bits() % end).unwrap()
    }

    /// True once in `n` times on average.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    pub fn pick<'a, T>(&mut self, values: &'a [T]) -> &'a T {
        &values[self.below(values.len())]
    }
}
