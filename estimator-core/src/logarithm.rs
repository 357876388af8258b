//! Natural logarithm and exponential in f32, from additions, multiplications and one division: the
//! same bits on every machine, and a few tens of instructions where `libm` takes a hundred.

use core::f32::consts::{LN_2, LOG2_E, SQRT_2};

/// Bound of the absolute error of [`ln`] for arguments from 1e-12 to 1e12, asserted by a sweep.
pub const LN_ERROR: f32 = 4.0e-6;

/// Bound of the relative error of [`exp`] for arguments from −20 to 20, asserted by a sweep.
pub const EXP_ERROR: f32 = 3.0e-6;

/// Magnitude to which [`exp`] limits its argument.
const LARGEST_EXPONENT: f32 = 80.0;

/// Bits of a float's fraction.
const FRACTION_BITS: u32 = 23;

/// The natural logarithm of a positive normal number. Total: any other argument gives a finite value
/// without meaning; zero gives a value below that of every normal number.
#[inline(never)]
#[must_use]
pub const fn ln(x: f32) -> f32 {
    const LOWEST: u32 = SQRT_2.to_bits() - (1 << FRACTION_BITS);
    // x = 2^exponent · m with m from 1/√2 to √2, and ln m = 2 artanh((m − 1)/(m + 1)).
    let bits = x.to_bits();
    let exponent = (bits.wrapping_sub(LOWEST) as i32) >> FRACTION_BITS;
    let m = f32::from_bits(bits.wrapping_sub((exponent as u32) << FRACTION_BITS));
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let series = 2.0 + square * (2.0 / 3.0 + square * (2.0 / 5.0 + square * (2.0 / 7.0)));
    exponent as f32 * LN_2 + s * series
}

/// The exponential function; beyond ±80 that of ±80. A NaN gives that of −80.
#[inline(never)]
#[must_use]
pub const fn exp(x: f32) -> f32 {
    let x = if x >= -LARGEST_EXPONENT { x } else { -LARGEST_EXPONENT };
    let x = if x <= LARGEST_EXPONENT { x } else { LARGEST_EXPONENT };
    // x = n ln 2 + r with r up to half of ln 2 in magnitude. The shift makes the truncating cast
    // round.
    let n = (x * LOG2_E + 128.5) as i32 - 128;
    let r = x - n as f32 * LN_2;
    let series = 1.0
        + r * (1.0
            + r * (1.0 / 2.0
                + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    let power = f32::from_bits(((n + 127) as u32) << FRACTION_BITS);
    series * power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 97th f32 from `from` to `to`, both positive.
    fn floats(from: f32, to: f32) -> impl Iterator<Item = f32> {
        (from.to_bits()..to.to_bits()).step_by(97).map(f32::from_bits)
    }

    #[test]
    fn the_logarithm_stays_within_its_stated_error() {
        let error = |x: f32| (f64::from(ln(x)) - f64::from(x).ln()).abs();
        let worst = floats(1.0e-12, 1.0e12).map(error).fold(0.0, f64::max);
        assert!(worst <= f64::from(LN_ERROR), "{worst:e}");
    }

    #[test]
    fn the_exponential_stays_within_its_stated_relative_error() {
        let error = |x: f32| (f64::from(exp(x)) / f64::from(x).exp() - 1.0).abs();
        let positive = floats(1.0e-6, 20.0);
        let worst = positive.flat_map(|x| [error(x), error(-x)]).fold(0.0, f64::max);
        assert!(worst <= f64::from(EXP_ERROR), "{worst:e}");
    }

    #[test]
    fn both_rise_and_exact_powers_are_exact() {
        for pair in [[0.7, 0.71], [0.707, 0.708], [1.41, 1.42], [1e-6, 2e-6]] {
            assert!(ln(pair[0]) < ln(pair[1]) && exp(pair[0]) < exp(pair[1]));
        }
        assert_eq!((ln(1.0), exp(0.0)), (0.0, 1.0));
    }

    #[test]
    fn every_argument_gives_a_finite_result() {
        for x in [
            0.0,
            -0.0,
            -1.0,
            f32::MIN_POSITIVE / 8.0,
            f32::MAX,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ] {
            assert!(ln(x).is_finite() && exp(x).is_finite(), "{x}");
        }
        assert!(ln(0.0) < ln(f32::MIN_POSITIVE));
    }
}
