//! The error function in f32, from a table that the compiler computes from the definition.
//!
//! A kernel mass is a difference of error functions, so the absolute error matters.
//! Cubic pieces between Chebyshev nodes keep it below [`ERF_ERROR`] with four multiplications
//! and one table row, where `libm::erff` needs an exponential and a division: the benches
//! `erf/table` and `erf/libm` hold the comparison.

mod table;

use table::{CUBICS, PIECES_PER_UNIT};

/// Bound of the absolute error of [`erf`] against the real error function, for every f32.
/// Asserted by a sweep in this module's tests.
pub const ERF_ERROR: f32 = 1.2e-7;

/// The error function erf(x) = 2/√π ∫₀ˣ exp(−t²) dt.
///
/// Dimensionless, in [−1, 1], odd; exactly ±1 from |x| = 4 on. The absolute error is at most
/// [`ERF_ERROR`]. A NaN gives a NaN.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 61 ULP from 0 to beyond saturation: 18 million points.
    fn sweep() -> impl Iterator<Item = f32> {
        (0..5.0_f32.to_bits()).step_by(61).map(f32::from_bits)
    }

    #[test]
    fn the_error_stays_below_the_stated_bound_over_the_whole_range() {
        let (error, at) = sweep()
            .map(|x| ((f64::from(erf(x)) - libm::erf(f64::from(x))).abs(), x))
            .fold((0.0, 0.0), |worst, now| if now.0 > worst.0 { now } else { worst });
        assert!(error <= f64::from(ERF_ERROR), "{error:e} at {at}");
        // The bound is tight: at most twice the largest error.
        assert!(error >= 0.5 * f64::from(ERF_ERROR), "{error:e} at {at}");
    }

    #[test]
    fn erf_is_odd_and_stays_within_minus_one_to_one() {
        for x in sweep().chain([f32::MAX, f32::INFINITY]) {
            let y = erf(x);
            assert!((0.0..=1.0).contains(&y) || y.abs() <= ERF_ERROR, "erf({x}) = {y}");
            assert!(y <= 1.0, "erf({x}) = {y}");
            assert_eq!(erf(-x), -y);
        }
    }

    #[test]
    fn it_is_exactly_one_in_the_tail() {
        for x in [4.0, 4.5, 1e3, f32::MAX, f32::INFINITY] {
            assert_eq!((erf(x), erf(-x)), (1.0, -1.0));
        }
    }
}
