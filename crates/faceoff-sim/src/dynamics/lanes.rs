//! Arithmetic on one number per arm: on one arm, or on several at once in the *lanes* (number slots) of a SIMD register.

use std::f64::consts::FRAC_2_PI;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::{f64x2, f64x4};

/// Largest number of lanes of a [`Lanes`] type.
pub const MAX_LANES: usize = 4;

/// A number per arm. The arm's equations are written once for any `Lanes`: with `f64` for one arm, with
/// [`f64x2`] for both arms of a table in one SIMD register, with four lanes for arms of several tables.
/// Each lane is IEEE double precision without contraction, so that all variants give the same bits.
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
    /// A boolean per arm.
    type Mask: Copy + std::fmt::Debug;

    /// Number of arms, at most [`MAX_LANES`].
    const COUNT: usize;

    /// The [`Lanes::bits`] of a mask that is true for all arms.
    const ALL: u32 = (1 << Self::COUNT) - 1;

    /// The same number for every arm.
    fn splat(value: f64) -> Self;

    /// One number per arm; `value` is called with the lane's index.
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self;

    /// The number of one arm.
    fn lane(self, index: usize) -> f64;

    /// Replaces the number of one arm.
    #[inline]
    fn set_lane(&mut self, index: usize, value: f64) {
        let before = *self;
        *self = Self::from_fn(|i| if i == index { value } else { before.lane(i) });
    }

    /// The nearest integer, ties to even, of a number below 2⁵¹ in magnitude.
    fn nearest(self) -> Self;

    fn abs(self) -> Self;

    /// The magnitude of `self` with the sign of `other`, also for zeros.
    fn copysign(self, other: Self) -> Self;

    /// `self < other`; false for NaN.
    fn less_than(self, other: Self) -> Self::Mask;

    /// `self <= other`; false for NaN.
    fn less_or_equal(self, other: Self) -> Self::Mask;

    fn mask_and(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    fn mask_or(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    fn mask_xor(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// `yes` where the mask is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// A mask as bits, 1 for true; the first arm has the lowest bit.
    fn bits(mask: Self::Mask) -> u32;

    /// The mask with these [`Lanes::bits`].
    #[inline]
    fn mask(bits: u32) -> Self::Mask {
        let yes = Self::from_fn(|i| f64::from(bits >> i & 1));
        Self::splat(0.0).less_than(yes)
    }

    /// `low` where `self` is below it. NaN stays NaN.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        Self::select(self.less_than(low), low, self)
    }

    /// `high` where `self` is above it. NaN stays NaN.
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        Self::select(high.less_than(self), high, self)
    }

    /// Sine and cosine of an angle in rad, with the same bits for every number of lanes. Up to a hundred turns they differ from
    /// `libm`'s by at most one unit in the last place.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let quarters = self * Self::splat(FRAC_2_PI);
        let quarters = quarters.nearest();
        // Cody and Waite's reduction: subtract whole quarter turns in two steps, the first one exact. Letters are fdlibm's: r is the
        // reduced angle, z its square.
        let r = self - quarters * Self::splat(PIO2_HEAD) - quarters * Self::splat(PIO2_TAIL);
        let z = r * r;
        let sin = kernel_sin(r, z);
        let cos = kernel_cos(z);
        if Self::COUNT <= 2 {
            return rotate_lane_by_lane(&quarters, &sin, &cos);
        }
        if Self::bits(quarters.abs().less_than(Self::splat(MAX_EXACT_QUARTERS))) != Self::ALL {
            return rotate_large_angles(&quarters, &sin, &cos);
        }
        // Quarter turns without whole turns, −2…2; all exact.
        let turns = (quarters * Self::splat(0.25)).nearest();
        rotate_quarters(quarters - turns * Self::splat(4.0), sin, cos)
    }
}

/// Sine and cosine after some quarter turns, from those of the reduced angle.
#[inline(always)]
fn rotate_lane_by_lane<T: Lanes>(quarters: &T, sin: &T, cos: &T) -> (T, T) {
    let (mut sines, mut cosines) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
    for lane in 0..T::COUNT {
        let (s, c) = (sin.lane(lane), cos.lane(lane));
        // The conversion is exact for small integers; larger angles have no accurate sine anyway.
        (sines[lane], cosines[lane]) = match quarters.lane(lane) as i64 & 3 {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        };
    }
    (T::from_fn(|i| sines[i]), T::from_fn(|i| cosines[i]))
}

/// [`rotate_lane_by_lane`] as a function that is not inlined: four lanes rarely need it.
#[cold]
#[inline(never)]
fn rotate_large_angles<T: Lanes>(quarters: &T, sin: &T, cos: &T) -> (T, T) {
    rotate_lane_by_lane(quarters, sin, cos)
}

/// Numbers of quarter turns below this (2⁵⁰) are exact.
const MAX_EXACT_QUARTERS: f64 = 1_125_899_906_842_624.0;

/// Sine and cosine after −2…2 quarter turns, from those of the reduced angle.
#[inline(always)]
pub(super) fn rotate_quarters<T: Lanes>(quarters: T, sin: T, cos: T) -> (T, T) {
    let half = T::splat(0.5);
    let size = quarters.abs();
    let odd = T::mask_xor(half.less_than(size), T::splat(1.5).less_than(size));
    let opposite = T::splat(1.5).less_than(size);
    let behind = quarters.less_than(T::splat(0.0) - half);
    let ahead = half.less_than(quarters);
    let (s, c) = (T::select(odd, cos, sin), T::select(odd, sin, cos));
    // The sine changes sign at −1 and ±2 quarters, the cosine at 1 and ±2.
    let sin = T::select(T::mask_or(behind, opposite), -s, s);
    let cos = T::select(T::mask_or(ahead, opposite), -c, c);
    (sin, cos)
}

/// 1.5 · 2⁵²: adding and subtracting it rounds a number to an integer.
pub(super) const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// The first 33 bits of π/2, and the rest of it, as in fdlibm (Sun's C library).
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
pub(super) const PIO2_HEAD: f64 = 1.570_796_326_734_125_614_17;
#[expect(
    clippy::excessive_precision,
    reason = "the digits of the published constants"
)]
pub(super) const PIO2_TAIL: f64 = 6.077_100_506_506_192_249_32e-11;

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

/// A polynomial in `z` by Horner's scheme, highest coefficient first.
#[inline(always)]
fn horner<T: Lanes>(z: T, coefficients: [f64; 6]) -> T {
    let mut sum = T::splat(coefficients[0]);
    for c in &coefficients[1..] {
        sum = sum * z + T::splat(*c);
    }
    sum
}

/// Collects one row of numbers per arm into lanes: number `i` of the result has number `i` of every arm's row.
#[inline(always)]
pub fn gather<'a, T: Lanes, const N: usize>(row: impl Fn(usize) -> &'a [f64; N]) -> [T; N] {
    let rows: [&[f64; N]; MAX_LANES] = std::array::from_fn(|lane| row(lane.min(T::COUNT - 1)));
    std::array::from_fn(|i| T::from_fn(|lane| rows[lane][i]))
}

/// The row of one arm, the inverse of [`gather`].
#[inline]
pub fn row<T: Lanes, const N: usize>(lanes: &[T; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|i| lanes[i].lane(lane))
}

/// Replaces the row of one arm.
#[inline]
pub fn set_row<T: Lanes, const N: usize>(lanes: &mut [T; N], lane: usize, row: &[f64; N]) {
    for i in 0..N {
        lanes[i].set_lane(lane, row[i]);
    }
}

impl Lanes for f64 {
    type Mask = bool;

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

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }

    #[inline(always)]
    fn copysign(self, other: Self) -> Self {
        self.copysign(other)
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn mask_and(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn mask_or(a: bool, b: bool) -> bool {
        a | b
    }

    #[inline(always)]
    fn mask_xor(a: bool, b: bool) -> bool {
        a ^ b
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }
}

/// Implements [`Lanes`] for a type of `wide`.
macro_rules! wide_lanes {
    ($vector:ident, $count:literal) => {
        impl Lanes for $vector {
            type Mask = Self;

            const COUNT: usize = $count;

            #[inline(always)]
            fn splat(value: f64) -> Self {
                Self::splat(value)
            }

            #[inline(always)]
            fn from_fn(value: impl FnMut(usize) -> f64) -> Self {
                Self::new(std::array::from_fn(value))
            }

            #[inline(always)]
            fn lane(self, index: usize) -> f64 {
                self.to_array()[index]
            }

            #[inline(always)]
            fn nearest(self) -> Self {
                (self + Self::splat(ROUNDING)) - Self::splat(ROUNDING)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                self & Self::splat(ABS_MASK)
            }

            #[inline(always)]
            fn copysign(self, other: Self) -> Self {
                self.abs() | (other & Self::splat(-0.0))
            }

            #[inline(always)]
            fn less_than(self, other: Self) -> Self {
                self.simd_lt(other)
            }

            #[inline(always)]
            fn less_or_equal(self, other: Self) -> Self {
                self.simd_le(other)
            }

            #[inline(always)]
            fn mask_and(a: Self, b: Self) -> Self {
                a & b
            }

            #[inline(always)]
            fn mask_or(a: Self, b: Self) -> Self {
                a | b
            }

            #[inline(always)]
            fn mask_xor(a: Self, b: Self) -> Self {
                a ^ b
            }

            #[inline(always)]
            fn select(mask: Self, yes: Self, no: Self) -> Self {
                mask.bitselect(yes, no)
            }

            #[inline(always)]
            fn bits(mask: Self) -> u32 {
                mask.to_bitmask()
            }
        }
    };
}

/// Mask of all bits except the sign.
pub(super) const ABS_MASK: f64 = f64::from_bits(i64::MAX as u64);

wide_lanes!(f64x2, 2);
wide_lanes!(f64x4, 4);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_matches_libm_within_rounding() {
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
