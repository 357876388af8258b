//! Motion of the part as a function of time.

use core::fmt;
use std::vec::Vec;

use crate::scale::STANDARD_GRAVITY;

/// Physical inputs of the part at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stimulus {
    /// Specific force in the axes of the sensor, m/s², gravity included.
    pub specific_force: [f64; 3],
    /// Angular rate, rad/s.
    pub angular_rate: [f64; 3],
    /// Temperature of the die, °C.
    pub temperature: f64,
}

impl Stimulus {
    /// At rest, z up, at 25 °C.
    pub const REST: Self = Self {
        specific_force: [0.0, 0.0, STANDARD_GRAVITY as f64],
        angular_rate: [0.0; 3],
        temperature: 25.0,
    };
}

impl Default for Stimulus {
    fn default() -> Self {
        Self::REST
    }
}

/// A source of motion. Closures from seconds to [`Stimulus`] are sources.
pub trait Motion {
    /// Returns the inputs `seconds` after the start. Times are ascending, 150 µs apart.
    fn at(&mut self, seconds: f64) -> Stimulus;
}

impl<F: FnMut(f64) -> Stimulus> Motion for F {
    fn at(&mut self, seconds: f64) -> Stimulus {
        self(seconds)
    }
}

/// Interpolation between two samples of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier of the two samples.
    Hold,
    /// A straight line.
    Linear,
}

/// Recorded motion at a stated rate, resampled to the part's clock. The first sample also applies before its time, and
/// the last one after its time.
#[derive(Clone, Debug)]
pub struct Recording {
    rate: f64,
    samples: Vec<Stimulus>,
    interpolation: Interpolation,
}

/// Reason why a recording is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RecordingError {
    /// The recording has no samples.
    Empty,
    /// The rate of the recording is not a positive number, Hz.
    Rate(f64),
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("the recording has no samples"),
            Self::Rate(rate) => write!(f, "the recording's rate is {rate} Hz"),
        }
    }
}

impl core::error::Error for RecordingError {}

impl Recording {
    /// Creates a recording of `rate` Hz.
    ///
    /// # Errors
    /// An error if there is no sample, or the rate is invalid.
    pub fn new(
        rate: f64,
        samples: Vec<Stimulus>,
        interpolation: Interpolation,
    ) -> Result<Self, RecordingError> {
        if samples.is_empty() {
            return Err(RecordingError::Empty);
        }
        if !(rate > 0.0 && rate.is_finite()) {
            return Err(RecordingError::Rate(rate));
        }
        Ok(Self { rate, samples, interpolation })
    }

    /// Time from the first sample to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        (self.samples.len() - 1) as f64 / self.rate
    }

    fn sample(&self, index: usize) -> Stimulus {
        self.samples[index.min(self.samples.len() - 1)]
    }
}

impl Motion for Recording {
    fn at(&mut self, seconds: f64) -> Stimulus {
        let position = seconds * self.rate;
        // The cast takes negative values to 0.
        let index = position as usize;
        let before = self.sample(index);
        if self.interpolation == Interpolation::Hold {
            return before;
        }
        let after = self.sample(index.saturating_add(1));
        let part = (position - index as f64).clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + (b - a) * part;
        let mix3 = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|i| mix(a[i], b[i]));
        Stimulus {
            specific_force: mix3(before.specific_force, after.specific_force),
            angular_rate: mix3(before.angular_rate, after.angular_rate),
            temperature: mix(before.temperature, after.temperature),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn ramp(interpolation: Interpolation) -> Recording {
        let sample = |t: f64| Stimulus { temperature: t, ..Stimulus::REST };
        let samples = vec![sample(10.0), sample(20.0), sample(40.0)];
        Recording::new(100.0, samples, interpolation).unwrap()
    }

    #[test]
    fn samples_are_interpolated_and_the_ends_are_held() {
        let mut recording = ramp(Interpolation::Linear);
        let at = [(-1.0, 10.0), (0.0, 10.0), (0.005, 15.0), (0.015, 30.0)];
        for (seconds, temperature) in at.into_iter().chain([(0.02, 40.0), (9.0, 40.0)]) {
            let found = recording.at(seconds).temperature;
            assert!((found - temperature).abs() < 1.0e-9, "{seconds}: {found}");
        }
        assert_eq!(recording.duration(), 0.02);
    }

    #[test]
    fn a_held_sample_lasts_until_the_next() {
        let mut recording = ramp(Interpolation::Hold);
        assert_eq!(recording.at(0.0099).temperature, 10.0);
        assert_eq!(recording.at(0.0101).temperature, 20.0);
    }

    #[test]
    fn recording_without_samples_or_rate_is_rejected() {
        let new = |rate, samples| Recording::new(rate, samples, Interpolation::Hold).err();
        assert_eq!(new(100.0, vec![]), Some(RecordingError::Empty));
        for rate in [0.0, -1.0, f64::INFINITY] {
            assert_eq!(new(rate, vec![Stimulus::REST]), Some(RecordingError::Rate(rate)));
        }
    }
}
