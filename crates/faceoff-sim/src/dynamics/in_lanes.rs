//! Work that is the same in lanes of any width.

use super::lanes::Lanes;

/// Something to be done in lanes. What it calls has to be inlined wherever it computes with lanes, since
/// functions are compiled for the registers that every machine has.
pub(crate) trait InLanes {
    /// What comes of it.
    type Output;

    /// Does it. To be marked `#[inline(always)]`.
    fn run<T: Lanes>(self) -> Self::Output;
}
