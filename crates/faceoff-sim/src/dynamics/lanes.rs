//! Arithmetic on one arm, or on several at once.

use std::f64::consts::FRAC_2_PI;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::{f64x2, f64x4};

/// No [`Lanes`] has more arms.
pub const MAX_LANES: usize = 4;

/// A number per arm. The arm's equations are written once for any `Lanes`: with `f64` they move one
/// arm, with [`f64x2`] both arms of a table in the two halves of a SIMD register, with four lanes arms of
/// several tables. Each lane is IEEE double precision without contraction, so that all ways give the same
/// bits.
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
    /// Yes or no per arm.
    type Mask: Copy + std::fmt::Debug;

    /// Number of arms, at most [`MAX_LANES`].
    const COUNT: usize;

    /// The [`Lanes::bits`] of a mask that says yes to all arms.
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

    /// The nearest integer, ties to even, of a number below 2⁵¹ in size.
    fn nearest(self) -> Self;

    fn abs(self) -> Self;

    /// The size of `self` with the sign of `other`, the sign of a zero included.
    fn with_sign_of(self, other: Self) -> Self;

    /// `self < other`; no for what is not a number.
    fn below(self, other: Self) -> Self::Mask;

    /// `self <= other`; no for what is not a number.
    fn within(self, other: Self) -> Self::Mask;

    /// Where both say yes.
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// Where one says yes.
    fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// Where one says yes and the other no.
    fn unequal(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// `yes` where the mask says so, `no` elsewhere.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// A mask as bits, the first arm's the lowest.
    fn bits(mask: Self::Mask) -> u32;

    /// The mask of [`Lanes::bits`].
    #[inline]
    fn mask(bits: u32) -> Self::Mask {
        let yes = Self::from_fn(|i| f64::from(bits >> i & 1));
        Self::splat(0.0).below(yes)
    }

    /// `low` where `self` is below it. What is not a number stays so.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        Self::choose(self.below(low), low, self)
    }

    /// `high` where `self` is above it. What is not a number stays so.
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        Self::choose(high.below(self), high, self)
    }

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
        if Self::COUNT <= 2 {
            return lane_by_lane(&quarters, &sin, &cos);
        }
        if Self::bits(quarters.abs().below(Self::splat(COUNTABLE))) != Self::ALL {
            return far_away(&quarters, &sin, &cos);
        }
        // In −2…2: quarter turns less whole turns, all exact.
        let turns = (quarters * Self::splat(0.25)).nearest();
        turned(quarters - turns * Self::splat(4.0), sin, cos)
    }
}

/// Sine and cosine after quarter turns, from those before.
#[inline(always)]
fn lane_by_lane<T: Lanes>(quarters: &T, sin: &T, cos: &T) -> (T, T) {
    let (mut sines, mut cosines) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
    for lane in 0..T::COUNT {
        let (s, c) = (sin.lane(lane), cos.lane(lane));
        // Exact: a small integer. Beyond its range the angle means nothing any more.
        (sines[lane], cosines[lane]) = match quarters.lane(lane) as i64 & 3 {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        };
    }
    (T::from_fn(|i| sines[i]), T::from_fn(|i| cosines[i]))
}

/// As [`lane_by_lane`], which is seldom needed for many lanes.
#[cold]
#[inline(never)]
fn far_away<T: Lanes>(quarters: &T, sin: &T, cos: &T) -> (T, T) {
    lane_by_lane(quarters, sin, cos)
}

/// Quarter turns below this are told apart exactly.
const COUNTABLE: f64 = 1_125_899_906_842_624.0;

/// Sine and cosine after −2…2 quarter turns, from those before.
#[inline(always)]
pub(super) fn turned<T: Lanes>(quarters: T, sin: T, cos: T) -> (T, T) {
    let half = T::splat(0.5);
    let size = quarters.abs();
    let odd = T::unequal(half.below(size), T::splat(1.5).below(size));
    let opposite = T::splat(1.5).below(size);
    let behind = quarters.below(T::splat(0.0) - half);
    let ahead = half.below(quarters);
    let (s, c) = (T::choose(odd, cos, sin), T::choose(odd, sin, cos));
    // The sine's sign turns at −1 and ±2 quarters, the cosine's at 1 and ±2.
    let sin = T::choose(T::either(behind, opposite), -s, s);
    let cos = T::choose(T::either(ahead, opposite), -c, c);
    (sin, cos)
}

/// See `nearest`.
pub(super) const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// The first 33 bits of π/2, and the rest of it (as in fdlibm).
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

/// A polynomial, highest coefficient first.
#[inline(always)]
fn horner<T: Lanes>(z: T, coefficients: [f64; 6]) -> T {
    let mut sum = T::splat(coefficients[0]);
    for c in &coefficients[1..] {
        sum = sum * z + T::splat(*c);
    }
    sum
}

/// The numbers of a row per arm.
#[inline(always)]
pub fn gather<'a, T: Lanes, const N: usize>(row: impl Fn(usize) -> &'a [f64; N]) -> [T; N] {
    let rows: [&[f64; N]; MAX_LANES] = std::array::from_fn(|lane| row(lane.min(T::COUNT - 1)));
    std::array::from_fn(|i| T::from_fn(|lane| rows[lane][i]))
}

/// The row of one arm.
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
    fn with_sign_of(self, other: Self) -> Self {
        self.copysign(other)
    }

    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn within(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn both(a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn either(a: bool, b: bool) -> bool {
        a | b
    }

    #[inline(always)]
    fn unequal(a: bool, b: bool) -> bool {
        a ^ b
    }

    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
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
                self & Self::splat(SIZE)
            }

            #[inline(always)]
            fn with_sign_of(self, other: Self) -> Self {
                self.abs() | (other & Self::splat(-0.0))
            }

            #[inline(always)]
            fn below(self, other: Self) -> Self {
                self.simd_lt(other)
            }

            #[inline(always)]
            fn within(self, other: Self) -> Self {
                self.simd_le(other)
            }

            #[inline(always)]
            fn both(a: Self, b: Self) -> Self {
                a & b
            }

            #[inline(always)]
            fn either(a: Self, b: Self) -> Self {
                a | b
            }

            #[inline(always)]
            fn unequal(a: Self, b: Self) -> Self {
                a ^ b
            }

            #[inline(always)]
            fn choose(mask: Self, yes: Self, no: Self) -> Self {
                mask.bitselect(yes, no)
            }

            #[inline(always)]
            fn bits(mask: Self) -> u32 {
                mask.to_bitmask()
            }
        }
    };
}

/// All bits of a number but its sign.
pub(super) const SIZE: f64 = f64::from_bits(i64::MAX as u64);

wide_lanes!(f64x2, 2);
wide_lanes!(f64x4, 4);

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
