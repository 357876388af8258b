//! The table behind [`erf`](super::erf): cubic pieces, fitted by the compiler.
//!
//! f64 arithmetic in the compiler is the same on every host, so the table is too.

// This code runs at compile time only, where an index out of range is a build error.
#![allow(clippy::indexing_slicing)]

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
