//! The error function in f32, from a table that the compiler computes from the definition.
//!
//! A kernel mass is a difference of error functions, so what counts is the absolute error.
//! Cubic pieces between Chebyshev nodes keep it below [`ERF_ERROR`] with four multiplications
//! and one table row, where `libm::erff` needs an exponential and a division: the benches
//! `erf/table` and `erf/libm` hold the comparison.

/// Bound of the absolute error of [`erf`] against the real error function, for every f32.
/// Asserted by a sweep in this module's tests.
pub const ERF_ERROR: f32 = 1.2e-7;

/// Where the error function is 1 to within half an f32 step: 1 − erf(4) = 1.5e-8.
const SATURATION: usize = 4;

/// Pieces per unit of the argument. With 16, the cubic's own error is below 3e-8.
const PIECES_PER_UNIT: usize = 16;

const PIECES: usize = SATURATION * PIECES_PER_UNIT;

/// Row `i` holds c₀…c₃ of erf((i + t)/16) ≈ c₀ + c₁t + c₂t² + c₃t³ for t in [0, 1).
static CUBICS: [[f32; 4]; PIECES] = cubics();

/// The error function erf(x) = 2/√π ∫₀ˣ exp(−t²) dt.
///
/// Dimensionless, in [−1, 1], odd; exactly ±1 from |x| = 4 on. The absolute error is at most
/// [`ERF_ERROR`]. A NaN gives 1 with the NaN's sign: callers that can meet one look first.
#[inline]
#[must_use]
pub fn erf(x: f32) -> f32 {
    erf_of_magnitude(x.abs()).copysign(x)
}

#[inline]
fn erf_of_magnitude(x: f32) -> f32 {
    let scaled = x * PIECES_PER_UNIT as f32;
    if !(scaled < PIECES as f32) {
        return 1.0;
    }
    let piece = scaled as usize;
    let t = scaled - piece as f32;
    match CUBICS.get(piece) {
        Some([c0, c1, c2, c3]) => c0 + t * (c1 + t * (c2 + t * c3)),
        None => 1.0,
    }
}

/// Fits every piece. Runs in the compiler, whose f64 arithmetic is the same on every host.
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
            .fold(
                (0.0, 0.0),
                |worst, now| if now.0 > worst.0 { now } else { worst },
            );
        assert!(error <= f64::from(ERF_ERROR), "{error:e} at {at}");
        // And the bound says something: it is not a multiple of what is reached.
        assert!(error >= 0.5 * f64::from(ERF_ERROR), "{error:e} at {at}");
    }

    #[test]
    fn it_is_odd_and_never_leaves_minus_one_to_one() {
        for x in sweep().chain([f32::MAX, f32::INFINITY]) {
            let y = erf(x);
            assert!(
                (0.0..=1.0).contains(&y) || y.abs() <= ERF_ERROR,
                "erf({x}) = {y}"
            );
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
