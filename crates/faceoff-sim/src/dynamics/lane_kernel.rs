//! Computations that are written once for lanes of any width.

use super::lanes::Lanes;

/// A computation in lanes. Every function that it calls with lanes must be inlined: functions that are not
/// are compiled for the baseline registers.
pub(crate) trait LaneKernel {
    type Output;

    /// Runs the kernel. Implementations must be `#[inline(always)]`.
    fn run<T: Lanes>(self) -> Self::Output;
}
