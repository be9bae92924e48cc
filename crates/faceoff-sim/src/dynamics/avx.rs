//! Four lanes (numbers that are computed at once) in the 256-bit registers of AVX, on machines that have them.
//!
//! The crate is built for every x86-64 CPU, which guarantees registers of two numbers only. `wide` selects
//! its instructions at compile time. Selecting them at run time needs the compiler's intrinsics, which are
//! unsafe without a guarantee of AVX. Only plain arithmetic is used: it rounds as without AVX, and nothing
//! is fused.

#![expect(
    unsafe_code,
    reason = "intrinsics of registers that are found at run time; each is pure arithmetic on values"
)]

use super::{
    lane_kernel::LaneKernel,
    lanes::{ABS_MASK, Lanes, ROUNDING},
};
use std::{
    arch::x86_64::{
        __m256d, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_add_pd, _mm256_and_pd, _mm256_andnot_pd,
        _mm256_blendv_pd, _mm256_cmp_pd, _mm256_div_pd, _mm256_max_pd, _mm256_min_pd,
        _mm256_movemask_pd, _mm256_mul_pd, _mm256_or_pd, _mm256_set1_pd, _mm256_setr_pd,
        _mm256_sub_pd, _mm256_xor_pd,
    },
    ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign},
};

/// Proof that this machine has AVX: values exist only there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx(());

impl Avx {
    /// `Some` on a machine with AVX.
    pub fn detect() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx").then_some(Self(()))
    }

    /// Runs a kernel in four lanes.
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx")]
        fn with_avx<K: LaneKernel>(kernel: K) -> K::Output {
            kernel.run::<F64x4>()
        }
        // SAFETY: `self` exists only on machines with AVX.
        unsafe { with_avx(kernel) }
    }
}

/// Four numbers. Values exist only within [`Avx::run`], so only on machines with AVX.
#[derive(Debug, Clone, Copy)]
pub struct F64x4(__m256d);

/// Calls an intrinsic.
macro_rules! intrinsic {
    ($result:expr) => {
        // SAFETY: pure arithmetic on values, which exist only on machines with AVX (`F64x4`).
        unsafe { $result }
    };
}

/// Implements an arithmetic operator by an intrinsic.
macro_rules! operator {
    ($operator:ident, $function:ident, $intrinsic:ident) => {
        impl $operator for F64x4 {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(intrinsic!($intrinsic(self.0, other.0)))
            }
        }
    };
}

operator!(Add, add, _mm256_add_pd);
operator!(Sub, sub, _mm256_sub_pd);
operator!(Mul, mul, _mm256_mul_pd);
operator!(Div, div, _mm256_div_pd);

impl Neg for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(intrinsic!(_mm256_xor_pd(self.0, _mm256_set1_pd(-0.0))))
    }
}

impl AddAssign for F64x4 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for F64x4 {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Lanes for F64x4 {
    type Mask = Self;

    const COUNT: usize = 4;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(intrinsic!(_mm256_set1_pd(value)))
    }

    #[inline(always)]
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self {
        let [a, b, c, d] = std::array::from_fn(value);
        Self(intrinsic!(_mm256_setr_pd(a, b, c, d)))
    }

    #[inline(always)]
    fn lane(self, index: usize) -> f64 {
        // SAFETY: four numbers of 64 bits each; every bit pattern is valid.
        let numbers: [f64; 4] = unsafe { std::mem::transmute(self.0) };
        numbers[index]
    }

    #[inline(always)]
    fn nearest(self) -> Self {
        (self + Self::splat(ROUNDING)) - Self::splat(ROUNDING)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(intrinsic!(_mm256_and_pd(self.0, _mm256_set1_pd(ABS_MASK))))
    }

    #[inline(always)]
    fn copysign(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_or_pd(
            _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0),
            _mm256_and_pd(_mm256_set1_pd(-0.0), other.0),
        )))
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn mask_and(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_and_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn mask_or(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_or_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn mask_xor(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_xor_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn select(mask: Self, yes: Self, no: Self) -> Self {
        Self(intrinsic!(_mm256_blendv_pd(no.0, yes.0, mask.0)))
    }

    #[inline(always)]
    fn bits(mask: Self) -> u32 {
        intrinsic!(_mm256_movemask_pd(mask.0)).cast_unsigned()
    }

    // The instructions return their second operand, here `self`, if the operands are equal or one of them is NaN.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        Self(intrinsic!(_mm256_max_pd(low.0, self.0)))
    }

    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        Self(intrinsic!(_mm256_min_pd(high.0, self.0)))
    }
}
