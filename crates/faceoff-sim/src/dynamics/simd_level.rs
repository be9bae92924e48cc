//! Selects the instruction set with which several arms are computed at once, one in each lane (number slot) of a register.

#[cfg(target_arch = "x86_64")]
use super::avx::Avx;
use super::{lane_kernel::LaneKernel, lanes::MAX_LANES};
use wide::{f64x2, f64x4};

/// The instruction set that computes four arms at once. All of them give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimdLevel(Registers);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Registers {
    /// Those that every CPU of the target has: two numbers each on x86-64.
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx(Avx),
}

impl SimdLevel {
    /// The registers that every CPU of the target has: two numbers each on x86-64.
    pub const PLAIN: Self = Self(Registers::Plain);

    /// The 256-bit registers of AVX; `None` on a machine without AVX.
    #[must_use]
    pub fn avx() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        return Avx::detect().map(|avx| Self(Registers::Avx(avx)));
        #[cfg(not(target_arch = "x86_64"))]
        None
    }

    /// The fastest level of this machine.
    #[must_use]
    pub fn fastest() -> Self {
        Self::avx().unwrap_or(Self::PLAIN)
    }

    /// Number of worlds with `robots` robots that are stepped at once. The two arms of a table fill a register
    /// of two numbers.
    pub(crate) fn worlds_at_once(self, robots: usize) -> usize {
        match self.0 {
            Registers::Plain if robots == 2 => 1,
            _ => MAX_LANES / robots,
        }
    }

    /// Runs a kernel on `arms` arms in lanes, at most [`MAX_LANES`].
    pub(crate) fn run<K: LaneKernel>(self, arms: usize, kernel: K) -> K::Output {
        match self.0 {
            Registers::Plain if arms <= 2 => kernel.run::<f64x2>(),
            Registers::Plain => kernel.run::<f64x4>(),
            #[cfg(target_arch = "x86_64")]
            Registers::Avx(avx) => avx.run(kernel),
        }
    }
}
