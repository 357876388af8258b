//! Functions of f32 with the same bits on every machine: minimum and maximum, square root, logarithm, exponential and
//! error function, computed only by additions, multiplications and divisions.
//!
//! `libm` is slower here. Counted once, its square root takes 70 instructions and a table, and its logarithm a hundred;
//! its error function has an exponential and a division. A Cortex-M4 has an instruction for the square root, but no stable
//! Rust without `unsafe` reaches it. The error of each function is stated, and asserted by a sweep over its arguments.

use core::f32::consts::{LN_2, LOG2_E, SQRT_2};

use erf_table::{CUBICS, PIECES_PER_UNIT};

/// Minimum and maximum in a comparison and a move; `f32::min` and `f32::max` are library calls on a Cortex-M4.
pub(crate) trait Order {
    /// Returns the lesser number; `other` if either is not a number.
    fn lesser(self, other: Self) -> Self;

    /// Returns the greater number; `other` if either is not a number.
    fn greater(self, other: Self) -> Self;
}

impl Order for f32 {
    #[inline]
    fn lesser(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline]
    fn greater(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
}

/// Bound of the relative error of [`sqrt`] for normal numbers, asserted by a sweep.
#[cfg(test)]
const SQRT_ERROR: f32 = 3.0e-7;

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

/// Bound of the absolute error of [`ln`] for arguments from 1e-12 to 1e12, asserted by a sweep.
#[cfg(test)]
const LN_ERROR: f32 = 4.0e-6;

/// Bound of the relative error of [`exp`] for arguments from −20 to 20, asserted by a sweep.
#[cfg(test)]
const EXP_ERROR: f32 = 3.0e-6;

/// Magnitude to which [`exp`] limits its argument.
const LARGEST_EXPONENT: f32 = 80.0;

/// Bits of a float's fraction.
const FRACTION_BITS: u32 = 23;

/// The natural logarithm of a positive normal number. Any other argument gives a finite value without
/// meaning, except that zero gives less than the logarithm of every normal number.
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

/// The exponential function. An argument beyond ±80 counts as ±80, and a NaN as −80.
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

/// Bound of the absolute error of [`erf`] against the real error function, for every f32.
/// Asserted by a sweep in this module's tests.
#[cfg(test)]
const ERF_ERROR: f32 = 1.2e-7;

/// The error function erf(x) = 2/√π ∫₀ˣ exp(−t²) dt.
///
/// Dimensionless, in [−1, 1], odd; exactly ±1 from |x| = 4 on. The absolute error is at most 1.2e-7. A NaN gives a NaN.
#[inline]
#[must_use]
pub fn erf(x: f32) -> f32 {
    erf_of_magnitude(x.abs()).copysign(x)
}

#[inline]
fn erf_of_magnitude(x: f32) -> f32 {
    let scaled = x * PIECES_PER_UNIT as f32;
    // The cast saturates, so the tail, infinity included, finds no row; a NaN finds row 0.
    let piece = scaled as usize;
    let t = scaled - piece as f32;
    match CUBICS.get(piece) {
        Some([c0, c1, c2, c3]) => c0 + t * (c1 + t * (c2 + t * c3)),
        None => 1.0,
    }
}

/// Cubic pieces of [`erf`] between Chebyshev nodes. Only the absolute error matters for a kernel mass, which is a
/// difference of two error functions. The compiler computes the table from the definition, in f64, which is the same on
/// every host.
// An index out of range is a build error, since this code runs in the compiler only.
#[allow(clippy::indexing_slicing)]
mod erf_table {
    /// Argument at which the error function is 1 to within half an f32 step: 1 − erf(4) = 1.5e-8.
    const SATURATION: usize = 4;

    /// Pieces per unit of the argument. With 16, the cubic's own error is below 3e-8.
    pub(super) const PIECES_PER_UNIT: usize = 16;

    const PIECES: usize = SATURATION * PIECES_PER_UNIT;

    /// Row `i` holds c₀…c₃ of erf((i + t)/16) ≈ c₀ + c₁t + c₂t² + c₃t³ for t in [0, 1).
    pub(super) static CUBICS: [[f32; 4]; PIECES] = cubics();

    /// Fits every piece.
    const fn cubics() -> [[f32; 4]; PIECES] {
        let mut rows = [[0.0; 4]; PIECES];
        let mut piece = 0;
        while piece < PIECES {
            rows[piece] = cubic(piece as f64);
            piece += 1;
        }
        rows
    }

    /// The cubic through erf at the four Chebyshev nodes of the piece that starts at `start`/16.
    const fn cubic(start: f64) -> [f32; 4] {
        /// ½ + ½cos((2j + 1)π/8), j = 0…3.
        const NODES: [f64; 4] = [
            0.961_939_766_255_643_4,
            0.691_341_716_182_544_9,
            0.308_658_283_817_455_1,
            0.038_060_233_744_356_6,
        ];
        // Newton's divided differences, in place.
        let mut d = [0.0; 4];
        let mut j = 0;
        while j < 4 {
            d[j] = erf_f64((start + NODES[j]) / PIECES_PER_UNIT as f64);
            j += 1;
        }
        let mut order = 1;
        while order < 4 {
            let mut j = 3;
            while j >= order {
                d[j] = (d[j] - d[j - 1]) / (NODES[j] - NODES[j - order]);
                j -= 1;
            }
            order += 1;
        }
        // From Newton's form to powers of t, by Horner's scheme on polynomials.
        let mut c = [d[3], 0.0, 0.0, 0.0];
        let mut j = 2;
        loop {
            c = [
                d[j] - NODES[j] * c[0],
                c[0] - NODES[j] * c[1],
                c[1] - NODES[j] * c[2],
                c[2] - NODES[j] * c[3],
            ];
            if j == 0 {
                break;
            }
            j -= 1;
        }
        [c[0] as f32, c[1] as f32, c[2] as f32, c[3] as f32]
    }

    /// erf by the series 2/√π exp(−x²) Σ 2ᵏ x²ᵏ⁺¹ / (2k+1)!!, whose terms are all positive
    /// (Abramowitz and Stegun 7.1.6), for 0 ≤ x ≤ 4.
    const fn erf_f64(x: f64) -> f64 {
        let x2 = x * x;
        let (mut exponential, mut power, mut sum, mut term) = (1.0, 1.0, x, x);
        let mut k = 1;
        while k < 120 {
            power *= x2 / k as f64;
            exponential += power;
            term *= 2.0 * x2 / (2 * k + 1) as f64;
            sum += term;
            k += 1;
        }
        core::f64::consts::FRAC_2_SQRT_PI * sum / exponential
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sqrt_stays_within_its_stated_error() {
        let numbers = (f32::MIN_POSITIVE.to_bits() + 1..f32::MAX.to_bits()).step_by(997);
        let error = |x: f32| (f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0).abs();
        let worst = numbers.map(|bits| error(f32::from_bits(bits))).fold(0.0, f64::max);
        assert!(worst <= f64::from(SQRT_ERROR), "{worst:e}");
    }

    #[test]
    fn inverse_root_stays_within_the_error_and_finite() {
        for x in [1.0e-6, 0.5, 3.0, 9.80665, 96.17, 1.0e8_f32] {
            let error = f64::from(inverse_root(x)) * f64::from(x).sqrt() - 1.0;
            assert!(error.abs() <= f64::from(SQRT_ERROR), "{x}: {error:e}");
        }
        for x in [0.0, -1.0, f32::NAN] {
            assert!(inverse_root(x).is_finite(), "{x}");
        }
    }

    #[test]
    fn sqrt_of_an_invalid_argument_is_zero() {
        for x in [0.0, -0.0, -1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(sqrt(x), 0.0, "{x}");
        }
    }

    #[test]
    fn rounded_gives_the_nearest_whole_number() {
        for (x, whole) in [(0.4, 0), (0.5, 1), (49.51, 50), (-3.0, 0), (f32::NAN, 0)] {
            assert_eq!(rounded(x), whole, "{x}");
        }
    }

    /// Every 97th f32 from `from` to `to`, both positive.
    fn floats(from: f32, to: f32) -> impl Iterator<Item = f32> {
        (from.to_bits()..to.to_bits()).step_by(97).map(f32::from_bits)
    }

    #[test]
    fn ln_stays_within_its_stated_error() {
        let error = |x: f32| (f64::from(ln(x)) - f64::from(x).ln()).abs();
        let worst = floats(1.0e-12, 1.0e12).map(error).fold(0.0, f64::max);
        assert!(worst <= f64::from(LN_ERROR), "{worst:e}");
    }

    #[test]
    fn exp_stays_within_its_stated_error() {
        let error = |x: f32| (f64::from(exp(x)) / f64::from(x).exp() - 1.0).abs();
        let positive = floats(1.0e-6, 20.0);
        let worst = positive.flat_map(|x| [error(x), error(-x)]).fold(0.0, f64::max);
        assert!(worst <= f64::from(EXP_ERROR), "{worst:e}");
    }

    #[test]
    fn ln_and_exp_rise_and_are_exact_at_one_and_zero() {
        for pair in [[0.7, 0.71], [0.707, 0.708], [1.41, 1.42], [1e-6, 2e-6]] {
            assert!(ln(pair[0]) < ln(pair[1]) && exp(pair[0]) < exp(pair[1]));
        }
        assert_eq!((ln(1.0), exp(0.0)), (0.0, 1.0));
    }

    #[test]
    fn ln_and_exp_are_finite_for_every_argument() {
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

    /// Steps of 61 ULP from 0 to beyond saturation: 18 million points.
    fn erf_arguments() -> impl Iterator<Item = f32> {
        (0..5.0_f32.to_bits()).step_by(61).map(f32::from_bits)
    }

    #[test]
    fn erf_stays_within_its_stated_error() {
        let (error, at) = erf_arguments()
            .map(|x| ((f64::from(erf(x)) - libm::erf(f64::from(x))).abs(), x))
            .fold((0.0, 0.0), |worst, now| if now.0 > worst.0 { now } else { worst });
        assert!(error <= f64::from(ERF_ERROR), "{error:e} at {at}");
        // The bound is tight: at most twice the largest error.
        assert!(error >= 0.5 * f64::from(ERF_ERROR), "{error:e} at {at}");
    }

    #[test]
    fn erf_is_odd_and_stays_within_minus_one_to_one() {
        for x in erf_arguments().chain([f32::MAX, f32::INFINITY]) {
            let y = erf(x);
            assert!((0.0..=1.0).contains(&y) || y.abs() <= ERF_ERROR, "erf({x}) = {y}");
            assert!(y <= 1.0, "erf({x}) = {y}");
            assert_eq!(erf(-x), -y);
        }
    }

    #[test]
    fn erf_is_exactly_one_in_the_tail() {
        for x in [4.0, 4.5, 1e3, f32::MAX, f32::INFINITY] {
            assert_eq!((erf(x), erf(-x)), (1.0, -1.0));
        }
    }
}
