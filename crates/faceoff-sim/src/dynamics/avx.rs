//! Four lanes in the 256-bit registers of AVX, on machines that have them.
//!
//! The crate is built for any x86-64, which promises registers of two numbers. `wide` decides when it is
//! compiled which ones it uses; the one way to decide when it runs is through the compiler's intrinsics,
//! which are unsafe where AVX is not promised. Only plain arithmetic is used: AVX's additions,
//! multiplications and divisions round as all others do, and nothing is fused.

#![expect(
    unsafe_code,
    reason = "intrinsics of registers that are found at run time; each is pure arithmetic on values"
)]

use super::{
    in_lanes::InLanes,
    lanes::{Lanes, ROUNDING, SIZE},
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

/// Says that this machine has AVX: there is none otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx(());

impl Avx {
    /// If the machine has it.
    pub fn detect() -> Option<Self> {
        std::arch::is_x86_feature_detected!("avx").then_some(Self(()))
    }

    /// Does something in four lanes.
    pub fn run<I: InLanes>(self, work: I) -> I::Output {
        #[target_feature(enable = "avx")]
        fn with_avx<I: InLanes>(work: I) -> I::Output {
            work.run::<F64x4>()
        }
        // SAFETY: `self` exists on machines with AVX only.
        unsafe { with_avx(work) }
    }
}

/// Four numbers. There are values of this type below [`Avx::run`] alone, so that whoever computes with
/// one is on a machine with AVX.
#[derive(Debug, Clone, Copy)]
pub struct F64x4(__m256d);

/// One function of the trait's, as one or two instructions.
macro_rules! intrinsic {
    ($result:expr) => {
        // SAFETY: pure arithmetic on values, which exist on machines with AVX only (`F64x4`).
        unsafe { $result }
    };
}

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
        // SAFETY: four numbers of 64 bits each, whatever their bits.
        let numbers: [f64; 4] = unsafe { std::mem::transmute(self.0) };
        numbers[index]
    }

    #[inline(always)]
    fn nearest(self) -> Self {
        (self + Self::splat(ROUNDING)) - Self::splat(ROUNDING)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(intrinsic!(_mm256_and_pd(self.0, _mm256_set1_pd(SIZE))))
    }

    #[inline(always)]
    fn with_sign_of(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_or_pd(
            _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0),
            _mm256_and_pd(_mm256_set1_pd(-0.0), other.0),
        )))
    }

    #[inline(always)]
    fn below(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn within(self, other: Self) -> Self {
        Self(intrinsic!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn both(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_and_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn either(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_or_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn unequal(a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm256_xor_pd(a.0, b.0)))
    }

    #[inline(always)]
    fn choose(mask: Self, yes: Self, no: Self) -> Self {
        Self(intrinsic!(_mm256_blendv_pd(no.0, yes.0, mask.0)))
    }

    #[inline(always)]
    fn bits(mask: Self) -> u32 {
        intrinsic!(_mm256_movemask_pd(mask.0)).cast_unsigned()
    }

    // The instructions keep their second operand where neither is greater, or one is not a number.
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        Self(intrinsic!(_mm256_max_pd(low.0, self.0)))
    }

    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        Self(intrinsic!(_mm256_min_pd(high.0, self.0)))
    }
}
