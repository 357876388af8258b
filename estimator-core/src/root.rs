//! Square root in f32, from multiplications: a Cortex-M4 has an instruction for it, but no stable
//! Rust without `unsafe` reaches it, and `libm` takes 70 instructions and a table.

use crate::order::Order;

/// Bound of the relative error of [`sqrt`] for normal numbers, asserted by a sweep.
pub const SQRT_ERROR: f32 = 3.0e-7;

/// The square root of a number; 0 for a NaN and for numbers up to the smallest normal number.
///
/// Newton's iteration for 1/√x, three times, from a guess by the exponent; then multiplied by x.
#[inline(never)]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    // A NaN fails the comparison.
    if x > f32::MIN_POSITIVE { x * inverse(x) } else { 0.0 }
}

/// 1/√x of a normal positive number, with the relative error of [`sqrt`]; finite for any other positive number.
#[inline]
pub(crate) fn inverse_root(x: f32) -> f32 {
    inverse(x.greater(f32::MIN_POSITIVE))
}

#[inline]
fn inverse(x: f32) -> f32 {
    /// The guess is within 3.5 % (C. Lomont, *Fast inverse square root*, 2003).
    const GUESS: u32 = 0x5f37_5a86;
    let half = 0.5 * x;
    let mut inverse = f32::from_bits(GUESS.wrapping_sub(x.to_bits() >> 1));
    for _ in 0..3 {
        inverse *= 1.5 - half * inverse * inverse;
    }
    inverse
}

/// Returns the nearest whole number; negative results are 0.
#[must_use]
pub(crate) const fn rounded(x: f32) -> u32 {
    // The cast truncates, and takes negative values and NaN to 0.
    (x + 0.5) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_stays_within_its_stated_relative_error() {
        let numbers = (f32::MIN_POSITIVE.to_bits() + 1..f32::MAX.to_bits()).step_by(997);
        let error = |x: f32| (f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0).abs();
        let worst = numbers.map(|bits| error(f32::from_bits(bits))).fold(0.0, f64::max);
        assert!(worst <= f64::from(SQRT_ERROR), "{worst:e}");
    }

    #[test]
    fn inverse_root_stays_within_the_same_error_and_finite() {
        for x in [1.0e-6, 0.5, 3.0, 9.80665, 96.17, 1.0e8_f32] {
            let error = f64::from(inverse_root(x)) * f64::from(x).sqrt() - 1.0;
            assert!(error.abs() <= f64::from(SQRT_ERROR), "{x}: {error:e}");
        }
        for x in [0.0, -1.0, f32::NAN] {
            assert!(inverse_root(x).is_finite(), "{x}");
        }
    }

    #[test]
    fn root_of_an_invalid_argument_is_zero() {
        for x in [0.0, -0.0, -1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(sqrt(x), 0.0, "{x}");
        }
    }

    #[test]
    fn whole_numbers_are_the_nearest() {
        for (x, whole) in [(0.4, 0), (0.5, 1), (49.51, 50), (-3.0, 0), (f32::NAN, 0)] {
            assert_eq!(rounded(x), whole, "{x}");
        }
    }
}
