//! Arithmetic on one arm or on two arms at once.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::f64x2;

/// A number per arm. The arm's equations are written once for any `Lanes`: with `f64` they move one
/// arm, with [`f64x2`] both arms of a table in the two halves of a SIMD register. Each lane is IEEE
/// double precision without contraction, so that both ways give the same bits.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Number of arms.
    const COUNT: usize;

    /// The same number for every arm.
    fn splat(value: f64) -> Self;

    /// One number per arm; `value` is called with the lane's index.
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self;

    /// The number of one arm.
    fn lane(self, index: usize) -> f64;

    /// Sine and cosine, the same bits for every number of lanes.
    fn sin_cos(self) -> (Self, Self);
}

impl Lanes for f64 {
    const COUNT: usize = 1;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        value(0)
    }

    #[inline(always)]
    fn lane(self, _index: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
}

impl Lanes for f64x2 {
    const COUNT: usize = 2;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        let first = value(0);
        Self::new([first, value(1)])
    }

    #[inline(always)]
    fn lane(self, index: usize) -> f64 {
        self.to_array()[index]
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let [a, b] = self.to_array();
        let ((sin_a, cos_a), (sin_b, cos_b)) = (libm::sincos(a), libm::sincos(b));
        (Self::new([sin_a, sin_b]), Self::new([cos_a, cos_b]))
    }
}
