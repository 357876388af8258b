//! A part that says "new" and repeats itself.

use crate::sample::RawSample;

/// Notices when fresh samples stop changing.
///
/// Each of the six codes scatters by its sensor's noise, at rest at the kilohertz preset by four
/// codes of specific force and one of angular rate: the odds that all six repeat are about one
/// in 200 000, and that they do so eight times in a row are none. Where the noise is below one
/// code, behind a narrow filter or at the end of the range, repeats are no sign of anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrozenDetector {
    last: RawSample,
    repeats: u16,
}

impl FrozenDetector {
    /// Repeated samples from which the part counts as frozen.
    pub const REPEATS: u16 = 8;

    /// A detector that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the next sample; whether the part is frozen. Stale samples change nothing: they are
    /// flagged as what they are already.
    pub fn update(&mut self, sample: &RawSample) -> bool {
        if sample.is_fresh() {
            let same = sample.angular_rate == self.last.angular_rate
                && sample.specific_force == self.last.specific_force;
            self.repeats = if same {
                self.repeats.saturating_add(1)
            } else {
                0
            };
            self.last = *sample;
        }
        self.repeats >= Self::REPEATS
    }

    /// How often in a row the last sample has come by now, beyond the first time: for whoever
    /// cannot wait for [`REPEATS`](Self::REPEATS) of them.
    #[must_use]
    pub const fn repeats(&self) -> u16 {
        self.repeats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn sample(status: u8, ax: u8) -> RawSample {
        let mut bytes = [0; 16];
        bytes[0] = status;
        bytes[10] = ax;
        RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).unwrap()
    }

    #[test]
    fn eight_repeats_of_a_fresh_sample_are_a_frozen_part() {
        let mut detector = FrozenDetector::new();
        for repeat in 0..=FrozenDetector::REPEATS {
            assert_eq!(
                detector.update(&sample(3, 7)),
                repeat == FrozenDetector::REPEATS
            );
        }
        assert!(!detector.update(&sample(3, 8)));
    }

    #[test]
    fn stale_samples_are_not_counted_as_repeats() {
        let mut detector = FrozenDetector::new();
        assert!((0..100).all(|_| !detector.update(&sample(0, 7))));
    }
}
