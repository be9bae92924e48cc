//! *Kernels*: computations that are written once, for any number of lanes (arms that are computed at once).

use super::lanes::Lanes;

/// A computation in lanes. Every function that it calls with lanes must be inlined: a function that is not inlined
/// is compiled for the registers that every CPU of the target has, instead of those of the chosen instruction set.
pub(crate) trait LaneKernel {
    type Output;

    /// Runs the kernel. Implementations must be `#[inline(always)]`.
    fn run<T: Lanes>(self) -> Self::Output;
}
