//! Arc tangent, sine and cosine in SIMD lanes (several numbers at once), with the same bits as the scalar functions of `libm`.
//!
//! If all four lanes are in the usual range, they are computed at once, in the order of operations of fdlibm (Sun's C library),
//! which `libm` follows; the letters of intermediate values are fdlibm's, too. Otherwise, and for fewer lanes, each lane calls `libm`.

use super::lanes::{Lanes, MAX_LANES, PIO2_HEAD, PIO2_TAIL, rotate_quarters};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Angle of the point (x, y), rad, as `libm::atan2`.
#[inline(always)]
pub fn atan2<T: Lanes>(y: T, x: T) -> T {
    if T::COUNT <= 2 {
        return T::from_fn(|lane| libm::atan2(y.lane(lane), x.lane(lane)));
    }
    let ratio = (y / x).abs();
    // Excludes NaN, infinities, and x and y both zero.
    if T::bits(ratio.less_or_equal(T::splat(STEEPEST_RATIO))) != T::ALL {
        return atan2_lane_by_lane(&y, &x);
    }
    let z = arc_tangent(ratio);
    let left = x.less_than(T::splat(0.0));
    let z = T::select(left, T::splat(PI) - (z - T::splat(PI_TAIL)), z);
    z.copysign(y)
}

/// Sine and cosine of an angle in rad, as `libm::sincos`.
#[inline(always)]
pub fn sin_cos<T: Lanes>(angle: T) -> (T, T) {
    if T::COUNT <= 2 {
        return sin_cos_lane_by_lane(&angle);
    }
    let size = angle.abs();
    // Near a quarter turn more digits of π are needed; beyond half a turn, more reduction.
    let near_quarter = T::mask_xor(
        T::splat(NEAR_QUARTER_TURN_RAD.0).less_or_equal(size),
        T::splat(NEAR_QUARTER_TURN_RAD.1).less_or_equal(size),
    );
    let far = T::splat(NEAR_HALF_TURN_RAD).less_or_equal(size);
    if T::bits(T::mask_or(near_quarter, far)) != 0 || T::bits(size.less_or_equal(size)) != T::ALL {
        return sin_cos_lane_by_lane(&angle);
    }
    let quarters = T::select(
        T::splat(TWO_QUARTERS_FROM_RAD).less_or_equal(size),
        T::splat(2.0),
        T::select(
            T::splat(ONE_QUARTER_FROM_RAD).less_or_equal(size),
            T::splat(1.0),
            T::splat(0.0),
        ),
    );
    let signed = quarters.copysign(angle);
    let z = angle - signed * T::splat(PIO2_HEAD);
    let x = z - signed * T::splat(PIO2_TAIL);
    let tail = (z - x) - signed * T::splat(PIO2_TAIL);
    let [s1, s2, s3, s4, s5, s6] = SINE.map(T::splat);
    let [c1, c2, c3, c4, c5, c6] = COSINE.map(T::splat);
    let z = x * x;
    let w = z * z;
    let r = s2 + z * (s3 + z * s4) + z * w * (s5 + z * s6);
    let v = z * x;
    let half = T::splat(0.5);
    let sin_of_reduced = T::select(
        half.less_than(quarters),
        x - ((z * (half * tail - v * r) - tail) - v * s1),
        x + v * (s1 + z * r),
    );
    // Tiny angles are their own sine, which also keeps the sign of a zero.
    let sin = T::select(size.less_than(T::splat(TINY_RAD)), angle, sin_of_reduced);
    let r = z * (c1 + z * (c2 + z * c3)) + w * w * (c4 + z * (c5 + z * c6));
    let half_square = half * z;
    let one = T::splat(1.0);
    let w = one - half_square;
    let cos = w + (((one - w) - half_square) + (z * r - x * tail));
    rotate_quarters(signed, sin, cos)
}

/// Arc tangent of a ratio that is not negative.
#[inline(always)]
fn arc_tangent<T: Lanes>(ratio: T) -> T {
    let one = T::splat(1.0);
    // Subtracts the nearest reference angle.
    let [is_past_first, is_past_second, is_past_third, is_past_fourth] =
        ARC_BOUNDS.map(|bound| T::splat(bound).less_or_equal(ratio));
    let by_reference_angle = |values: [T; 5]| {
        let low = T::select(is_past_first, values[1], values[0]);
        let middle = T::select(is_past_second, values[2], low);
        T::select(
            is_past_fourth,
            values[4],
            T::select(is_past_third, values[3], middle),
        )
    };
    let numerator = by_reference_angle([
        ratio,
        T::splat(2.0) * ratio - one,
        ratio - one,
        ratio - T::splat(1.5),
        -one,
    ]);
    let denominator = by_reference_angle([
        one,
        T::splat(2.0) + ratio,
        ratio + one,
        one + T::splat(1.5) * ratio,
        ratio,
    ]);
    let x = numerator / denominator;
    let z = x * x;
    let w = z * z;
    let a = ARC_TANGENT.map(T::splat);
    let odd = z * (a[0] + w * (a[2] + w * (a[4] + w * (a[6] + w * (a[8] + w * a[10])))));
    let even = w * (a[1] + w * (a[3] + w * (a[5] + w * (a[7] + w * a[9]))));
    by_reference_angle(ARC_HEAD.map(T::splat))
        - (x * (odd + even) - by_reference_angle(ARC_TAIL.map(T::splat)) - x)
}

#[cold]
#[inline(never)]
fn atan2_lane_by_lane<T: Lanes>(y: &T, x: &T) -> T {
    T::from_fn(|lane| libm::atan2(y.lane(lane), x.lane(lane)))
}

#[inline(never)]
fn sin_cos_lane_by_lane<T: Lanes>(angle: &T) -> (T, T) {
    let (mut sines, mut cosines) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
    for lane in 0..T::COUNT {
        (sines[lane], cosines[lane]) = libm::sincos(angle.lane(lane));
    }
    (T::from_fn(|i| sines[i]), T::from_fn(|i| cosines[i]))
}

/// Ratios y / x above this (2⁶⁰) have the arc tangent π/2.
const STEEPEST_RATIO: f64 = 1_152_921_504_606_846_976.0;
/// π minus the `f64` nearest to it.
const PI_TAIL: f64 = 1.224_646_799_147_353_2e-16;
/// Angles from which `libm` subtracts one and two quarter turns, rad.
const ONE_QUARTER_FROM_RAD: f64 = f64::from_bits(0x3fe9_21fc_0000_0000);
const TWO_QUARTERS_FROM_RAD: f64 = f64::from_bits(0x4002_d97d_0000_0000);
/// Range of angles near a quarter turn, rad.
const NEAR_QUARTER_TURN_RAD: (f64, f64) = (
    f64::from_bits(0x3ff9_21fb_0000_0000),
    f64::from_bits(0x3ff9_21fc_0000_0000),
);
/// Angles from here on are near half a turn or beyond, rad.
const NEAR_HALF_TURN_RAD: f64 = f64::from_bits(0x4009_21fb_0000_0000);
/// Below this angle, rad, the sine equals the angle.
const TINY_RAD: f64 = f64::from_bits(0x3e46_a09e_0000_0000);
/// Ratios from which the second, third, … of the reference angles (below) is the nearest.
const ARC_BOUNDS: [f64; 4] = [0.4375, 0.6875, 1.1875, 2.4375];

/// Coefficients of the polynomials for sine, cosine and arc tangent, as published with fdlibm.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-06,
    -2.505_076_025_340_686_3e-08,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-05,
    -2.755_731_435_139_066_3e-07,
    2.087_572_321_298_175e-09,
    -1.135_964_755_778_819_5e-11,
];
const ARC_TANGENT: [f64; 11] = [
    0.333_333_333_333_329_3,
    -0.199_999_999_998_764_83,
    0.142_857_142_725_034_66,
    -0.111_111_104_054_623_56,
    0.090_908_871_334_365_07,
    -0.076_918_762_050_448_3,
    0.066_610_731_373_875_31,
    -0.058_335_701_337_905_735,
    0.049_768_779_946_159_324,
    -0.036_531_572_744_216_916,
    0.016_285_820_115_365_782,
];
/// The reference angles 0, atan ½, π/4, atan 1½, π/2, rad: each is the sum of a head (the nearest `f64`) and a tail.
const ARC_HEAD: [f64; 5] = [
    0.0,
    0.463_647_609_000_806_1,
    FRAC_PI_4,
    0.982_793_723_247_329,
    FRAC_PI_2,
];
const ARC_TAIL: [f64; 5] = [
    0.0,
    2.269_877_745_296_168_7e-17,
    3.061_616_997_868_383e-17,
    1.390_331_103_123_099_8e-17,
    6.123_233_995_736_766e-17,
];

#[cfg(test)]
mod tests {
    use super::*;
    use wide::f64x4;

    fn assert_same_bits(actual: f64, expected: f64, label: &str) {
        let same = actual.to_bits() == expected.to_bits() || (actual.is_nan() && expected.is_nan());
        assert!(same, "{label}: {actual:e} and {expected:e}");
    }

    /// Numbers of all magnitudes and signs, and the neighbours of each limit between two formulas.
    fn numbers() -> Vec<f64> {
        let mut all = vec![0.0, f64::INFINITY, f64::NAN, f64::MIN_POSITIVE, 5e-324];
        let edges = [
            ONE_QUARTER_FROM_RAD,
            TWO_QUARTERS_FROM_RAD,
            NEAR_QUARTER_TURN_RAD.0,
            NEAR_QUARTER_TURN_RAD.1,
            NEAR_HALF_TURN_RAD,
            TINY_RAD,
            STEEPEST_RATIO,
        ];
        for edge in edges
            .into_iter()
            .chain(ARC_BOUNDS)
            .chain([std::f64::consts::FRAC_PI_4, 1.0])
        {
            all.extend([edge.next_down(), edge, edge.next_up()]);
        }
        for k in 0..400 {
            all.push(0.008 * f64::from(k) + 1e-5 * f64::from(k * k % 97));
        }
        for exponent in -330..308 {
            all.push(1.7 * libm::pow(10.0, f64::from(exponent)));
        }
        let negative: Vec<f64> = all.iter().map(|x| -x).collect();
        all.extend(negative);
        all
    }

    #[test]
    fn sin_cos_matches_libm() {
        // Ordinary angles in the other lanes, so that the lanes are computed at once where possible.
        for x in numbers() {
            let (sines, cosines) = sin_cos(f64x4::new([x, 0.3, -1.2, 2.9]));
            for (lane, angle) in [x, 0.3, -1.2, 2.9].into_iter().enumerate() {
                let (sin, cos) = libm::sincos(angle);
                assert_same_bits(sines.lane(lane), sin, &format!("sine of {angle:e}"));
                assert_same_bits(cosines.lane(lane), cos, &format!("cosine of {angle:e}"));
            }
        }
    }

    #[test]
    fn atan2_matches_libm() {
        let numbers = numbers();
        for (i, &x) in numbers.iter().enumerate() {
            for &y in numbers.iter().skip(i % 7).step_by(7) {
                let (ys, xs) = ([y, 0.1, x, -2.0], [x, 1.0, y, 0.5]);
                let angles = atan2(f64x4::new(ys), f64x4::new(xs));
                for lane in 0..4 {
                    let label = format!("angle of ({:e}, {:e})", xs[lane], ys[lane]);
                    assert_same_bits(angles.lane(lane), libm::atan2(ys[lane], xs[lane]), &label);
                }
            }
        }
    }
}
