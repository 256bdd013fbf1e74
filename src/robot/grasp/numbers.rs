//! Sines and powers of several numbers at once, from plain sums and products: the same bits wherever they are compiled,
//! with vector instructions where available.

use std::f64::consts::{FRAC_2_PI, LOG2_E};

/// Adding and subtracting it rounds to a whole number, which is in the lowest bits of the sum.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// A quarter of a revolution in two parts; the first has so few digits that a small multiple of it is exact.
const QUARTER: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];

/// ln 2 likewise.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// 1 / n! for n from 0.
const FACTORIALS: [f64; 17] = {
    let mut inverse = [1.0; 17];
    let mut product = 1.0;
    let mut n = 1;
    while n < 17 {
        product *= n as f64;
        inverse[n] = 1.0 / product;
        n += 1;
    }
    inverse
};

/// Sine and cosine of angles up to a thousand [rad], to 1e-15.
#[inline(always)]
pub(super) fn sines<const N: usize>(angles: &[f64; N]) -> [[f64; N]; 2] {
    let mut out = [[0.0; N]; 2];
    for lane in 0..N {
        let angle = angles[lane];
        // Cody-Waite argument reduction to within an eighth of a revolution; the constant has two parts.
        let rounded = angle * FRAC_2_PI + ROUND;
        let (quarters, count) = (rounded.to_bits(), rounded - ROUND);
        let rest = angle - count * QUARTER[0] - count * QUARTER[1];
        let square = rest * rest;
        // Taylor's series: below an eighth of a revolution the next terms are less than rounding.
        let mut sin = FACTORIALS[15];
        sin = FACTORIALS[13] - sin * square;
        sin = FACTORIALS[11] - sin * square;
        sin = FACTORIALS[9] - sin * square;
        sin = FACTORIALS[7] - sin * square;
        sin = FACTORIALS[5] - sin * square;
        sin = FACTORIALS[3] - sin * square;
        sin = rest - rest * square * sin;
        let mut cos = FACTORIALS[16];
        cos = FACTORIALS[14] - cos * square;
        cos = FACTORIALS[12] - cos * square;
        cos = FACTORIALS[10] - cos * square;
        cos = FACTORIALS[8] - cos * square;
        cos = FACTORIALS[6] - cos * square;
        cos = FACTORIALS[4] - cos * square;
        cos = FACTORIALS[2] - cos * square;
        cos = 1.0 - cos * square;
        // Odd quarters swap sine and cosine.
        let swapped = quarters & 1 == 1;
        let (a, b) = if swapped { (cos, sin) } else { (sin, cos) };
        // Of the sine in the second half of a revolution, of the cosine in the second and third quarter.
        let (sign_of_sin, sign_of_cos) = ((quarters & 2) << 62, (quarters.wrapping_add(1) & 2) << 62);
        out[0][lane] = f64::from_bits(a.to_bits() ^ sign_of_sin);
        out[1][lane] = f64::from_bits(b.to_bits() ^ sign_of_cos);
    }
    out
}

/// e^x of numbers from -700 to 700, to 1e-14 of it.
#[inline(always)]
pub(super) fn exponentials<const N: usize>(numbers: &[f64; N]) -> [f64; N] {
    let mut out = [0.0; N];
    for lane in 0..N {
        let number = numbers[lane];
        let rounded = number * LOG2_E + ROUND;
        let doublings = rounded - ROUND;
        let rest = number - doublings * LN_2[0] - doublings * LN_2[1];
        let mut sum = FACTORIALS[12];
        let mut term = 12;
        while term > 0 {
            term -= 1;
            sum = FACTORIALS[term] + sum * rest;
        }
        // The lowest bits hold the count of doublings, which goes into the exponent.
        out[lane] = f64::from_bits(sum.to_bits().wrapping_add(rounded.to_bits() << 52));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_are_those_of_libm() {
        for count in -40_000i32..40_000 {
            let angle = f64::from(count) * 3.1e-4;
            let [[sin], [cos]] = sines(&[angle]);
            let truth = libm::sincos(angle);
            assert!((sin - truth.0).abs() < 4e-16 && (cos - truth.1).abs() < 4e-16, "{angle}: {sin} {cos} {truth:?}");
        }
    }

    #[test]
    fn exponentials_are_those_of_libm() {
        for count in -30_000i32..30_000 {
            let number = f64::from(count) * 1.3e-3;
            let [found] = exponentials(&[number]);
            let truth = libm::exp(number);
            assert!((found - truth).abs() < 1e-14 * truth, "{number}: {found} {truth}");
        }
    }
}
