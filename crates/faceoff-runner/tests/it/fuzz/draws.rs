/// SplitMix64: good enough to choose what to break.
pub struct Draws(u64);

impl Draws {
    /// The draws of one run.
    pub fn of(target: &str, seed: u64, run: u64) -> Self {
        let mut draws = Self(seed);
        for byte in target.bytes().chain(run.to_le_bytes()) {
            draws.0 = draws.0.wrapping_add(u64::from(byte));
            draws.0 = draws.bits();
        }
        draws
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// From 0 to below `end`; 0 where that is nothing.
    pub fn below(&mut self, end: usize) -> usize {
        let end = u64::try_from(end.max(1)).unwrap();
        usize::try_from(self.bits() % end).unwrap()
    }

    /// Once in `n` times.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    pub fn pick<'a, T>(&mut self, among: &'a [T]) -> &'a T {
        &among[self.below(among.len())]
    }
}
