//! The dynamics of an arm, for one arm or for several at once in the lanes (number slots) of SIMD registers.

pub mod angles;
pub mod arm;
#[cfg(target_arch = "x86_64")]
mod avx;
pub(crate) mod lane_kernel;
pub mod lanes;
pub mod ldlt;
pub mod simd_level;
pub mod spatial;
