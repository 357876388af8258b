//! Seeded random numbers, the same on every machine and with every version of a library.
//!
//! Only the raw 64-bit words come from a crate (PCG's `pcg64`, a published algorithm that does not change); they
//! are converted to real numbers here, because libraries are free to change their conversion.

use std::ops::Range;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Use of the numbers. Each use has its own stream, so that more draws in one do not shift the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RandomUse {
    /// Variation from step to step.
    Steps = 1,
    /// Errors of a sensor's specimen.
    Specimen = 2,
    /// Choice of the steps that meet a patch of other ground.
    Patches = 3,
}

/// A seeded source of real numbers.
#[derive(Clone, Debug)]
pub(crate) struct SeededRandom {
    words: Pcg64,
}

impl SeededRandom {
    /// Creates the stream of a seed and use.
    pub fn new(seed: u64, stream: RandomUse) -> Self {
        Self { words: Pcg64::new(u128::from(seed), stream as u128) }
    }

    /// Draws uniformly from [0, 1), in steps of 2⁻⁵³.
    fn unit(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.words.next_u64() >> 11) as f64 * STEP
    }

    /// Draws uniformly from a range.
    pub fn uniform(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.unit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_and_seeds_are_independent() {
        let first = |seed, stream| SeededRandom::new(seed, stream).unit();
        let one = first(1, RandomUse::Steps);
        assert_eq!(one, first(1, RandomUse::Steps));
        assert_ne!(one, first(2, RandomUse::Steps));
        assert_ne!(one, first(1, RandomUse::Specimen));
    }
}
