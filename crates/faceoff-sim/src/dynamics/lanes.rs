//! Arithmetic on one arm or on two arms at once.

use std::f64::consts::FRAC_2_PI;
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

    /// The nearest integer, ties to even, of a number below 2⁵¹ in size.
    fn nearest(self) -> Self;

    /// Sine and cosine of an angle in rad, the same bits for every number of lanes, within an ulp of
    /// `libm` up to a hundred turns.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let quarters = self * Self::splat(FRAC_2_PI);
        let quarters = quarters.nearest();
        // Cody and Waite: two steps, the first exact, take whole quarter turns off.
        let r = self - quarters * Self::splat(PIO2_HEAD) - quarters * Self::splat(PIO2_TAIL);
        let z = r * r;
        let sin = kernel_sin(r, z);
        let cos = kernel_cos(z);
        let mut sines = [0.0; 2];
        let mut cosines = [0.0; 2];
        for lane in 0..Self::COUNT {
            let (s, c) = (sin.lane(lane), cos.lane(lane));
            // Exact: a small integer. Beyond its range the angle means nothing any more.
            (sines[lane], cosines[lane]) = match quarters.lane(lane) as i64 & 3 {
                0 => (s, c),
                1 => (c, -s),
                2 => (-s, -c),
                _ => (-c, s),
            };
        }
        (
            Self::from_fn(|lane| sines[lane]),
            Self::from_fn(|lane| cosines[lane]),
        )
    }
}

/// See `nearest`.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// The first 33 bits of π/2, and the rest of it (as in fdlibm).
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
const PIO2_HEAD: f64 = 1.570_796_326_734_125_614_17;
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
const PIO2_TAIL: f64 = 6.077_100_506_506_192_249_32e-11;

/// Sine within ±π/4 of `r`, whose square is `z` (fdlibm's polynomial).
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
#[inline(always)]
fn kernel_sin<T: Lanes>(r: T, z: T) -> T {
    let p = horner(
        z,
        [
            1.589_690_995_211_550_102_21e-10,
            -2.505_076_025_340_686_341_95e-8,
            2.755_731_370_707_006_767_89e-6,
            -1.984_126_982_985_794_931_34e-4,
            8.333_333_333_322_489_461_24e-3,
            -1.666_666_666_666_663_243_48e-1,
        ],
    );
    r + r * z * p
}

/// Cosine within ±π/4 of the angle whose square is `z` (fdlibm's polynomial).
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
#[inline(always)]
fn kernel_cos<T: Lanes>(z: T) -> T {
    let p = horner(
        z,
        [
            -1.135_964_755_778_819_482_65e-11,
            2.087_572_321_298_174_827_90e-9,
            -2.755_731_435_139_066_330_35e-7,
            2.480_158_728_947_672_941_78e-5,
            -1.388_888_888_887_410_957_49e-3,
            4.166_666_666_666_660_190_37e-2,
        ],
    );
    let half = T::splat(0.5) * z;
    let w = T::splat(1.0) - half;
    w + (((T::splat(1.0) - w) - half) + z * z * p)
}

/// A polynomial, highest coefficient first.
#[inline(always)]
fn horner<T: Lanes>(z: T, coefficients: [f64; 6]) -> T {
    let mut sum = T::splat(coefficients[0]);
    for c in &coefficients[1..] {
        sum = sum * z + T::splat(*c);
    }
    sum
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
    fn nearest(self) -> Self {
        // Adding 1.5 · 2⁵² pushes the fraction out of the mantissa, in every lane alike.
        (self + ROUNDING) - ROUNDING
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
    fn nearest(self) -> Self {
        (self + Self::splat(ROUNDING)) - Self::splat(ROUNDING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_libms_within_rounding() {
        for k in -2_000..2_000 {
            let angle = f64::from(k) * 0.003_7;
            let (sin, cos) = Lanes::sin_cos(angle);
            assert!((sin - libm::sin(angle)).abs() < 3e-16, "{angle}");
            assert!((cos - libm::cos(angle)).abs() < 3e-16, "{angle}");
            let (sines, cosines) = Lanes::sin_cos(f64x2::new([-angle, angle]));
            assert_eq!((sines.lane(1), cosines.lane(1)), (sin, cos));
            assert_eq!((sines.lane(0), cosines.lane(0)), (-sin, cos));
        }
    }
}
