//! Chance with a seed: the same numbers on every machine and from every version of a library.
//!
//! Only the raw 64-bit words come from a crate (PCG's `pcg64`, a published algorithm that does
//! not change); how they become real numbers is written here, on `libm`, because libraries are
//! free to change theirs and some call the platform's logarithm.

use std::ops::Range;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// What the numbers are for. Each use has a stream of its own, so that more draws in one do not
/// shift the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    /// The variation from step to step.
    Steps = 1,
    /// A sensor's biases and their drift.
    Biases = 2,
    /// A sensor's noise.
    Noise = 3,
}

/// A seeded source of real numbers.
#[derive(Clone, Debug)]
pub(super) struct Random {
    words: Pcg64,
    /// Box and Muller's method makes two at a time.
    spare_normal: Option<f64>,
}

impl Random {
    /// The stream of numbers that belongs to `seed` and use.
    pub fn new(seed: u64, stream: Stream) -> Self {
        Self {
            words: Pcg64::new(u128::from(seed), stream as u128),
            spare_normal: None,
        }
    }

    /// Evenly from [0, 1), in steps of 2⁻⁵³.
    fn unit(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.words.next_u64() >> 11) as f64 * STEP
    }

    /// Evenly from a range.
    pub fn uniform(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.unit()
    }

    /// From the normal distribution with mean 0 and standard deviation 1 (Box and Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        // 1 − u lies in (0, 1], where the logarithm is finite.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        self.spare_normal = Some(radius * sin);
        radius * cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_numbers_have_mean_zero_and_unit_variance() {
        let mut random = Random::new(7, Stream::Noise);
        let numbers: Vec<f64> = (0..200_000).map(|_| random.normal()).collect();
        let mean_of = |f: fn(f64) -> f64| numbers.iter().copied().map(f).sum::<f64>() / 200_000.0;
        assert!(mean_of(|x| x).abs() < 0.01);
        assert!((mean_of(|x| x * x) - 1.0).abs() < 0.02);
        // The normal distribution's fourth moment is 3; a uniform one's would be 1.8.
        assert!((mean_of(|x| x * x * x * x) - 3.0).abs() < 0.1);
    }

    #[test]
    fn streams_and_seeds_are_independent() {
        let first = |seed, stream| Random::new(seed, stream).unit();
        let one = first(1, Stream::Steps);
        assert_eq!(one, first(1, Stream::Steps));
        assert_ne!(one, first(2, Stream::Steps));
        assert_ne!(one, first(1, Stream::Noise));
    }
}
