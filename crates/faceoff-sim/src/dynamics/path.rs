//! Which registers four lanes are computed in.

#[cfg(target_arch = "x86_64")]
use super::avx::Avx;
use super::{in_lanes::InLanes, lanes::MAX_LANES};
use wide::{f64x2, f64x4};

/// How four arms are computed at once. All ways give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LanePath(Registers);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Registers {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx(Avx),
}

impl LanePath {
    /// In the registers that every machine of this kind has: of two numbers each on x86-64.
    pub const PLAIN: Self = Self(Registers::Plain);

    /// In the 256-bit registers of AVX; none on a machine without them.
    #[must_use]
    pub fn avx() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        return Avx::detect().map(|avx| Self(Registers::Avx(avx)));
        #[cfg(not(target_arch = "x86_64"))]
        None
    }

    /// The fastest one that this machine has.
    #[must_use]
    pub fn fastest() -> Self {
        Self::avx().unwrap_or(Self::PLAIN)
    }

    /// How many worlds of so many robots are moved at once. Registers of two numbers are full with the two
    /// arms of a table.
    pub(crate) fn worlds_at_once(self, robots: usize) -> usize {
        match self.0 {
            Registers::Plain if robots == 2 => 1,
            _ => MAX_LANES / robots,
        }
    }

    /// Does something with so many arms in lanes, at most [`MAX_LANES`].
    pub(crate) fn run<I: InLanes>(self, arms: usize, work: I) -> I::Output {
        match self.0 {
            Registers::Plain if arms <= 2 => work.run::<f64x2>(),
            Registers::Plain => work.run::<f64x4>(),
            #[cfg(target_arch = "x86_64")]
            Registers::Avx(avx) => avx.run(work),
        }
    }
}
