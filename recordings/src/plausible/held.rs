//! Readings that are held: rows that come more often than the sensor was read.

use super::Finding;
use crate::recording::RecordedSample;

/// From this share of repeated readings on, they are held. In recordings of sensors that were read for each
/// row, and of simulated robots, it is at most 0.017; on a GO1 that was read at 70 Hz and held to 250 Hz, 0.72.
const HELD_SHARE: f64 = 0.25;

/// A reading that is repeated more often in a row is not held: a simulated foot rests, or a sensor is stuck.
const LONGEST_HOLD: u64 = 50;

/// Counts readings that repeat the one before, until another comes.
#[derive(Default)]
pub(super) struct HeldCheck {
    newest: Option<[f32; 6]>,
    samples: u64,
    /// In a row, up to the newest sample.
    run: u64,
    repeats: u64,
}

impl HeldCheck {
    pub(super) fn add(&mut self, sample: &RecordedSample) {
        let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        let reading = [a.x, a.y, a.z, w.x, w.y, w.z];
        self.samples += 1;
        if self.newest.replace(reading) != Some(reading) {
            if self.run <= LONGEST_HOLD {
                self.repeats += self.run;
            }
            self.run = 0;
        } else if reading.iter().any(|axis| *axis != 0.0) {
            // A simulated foot without gravity at perfect rest has zeros, which are readings.
            self.run += 1;
        }
    }

    /// Whether readings are held in rows at `sample_rate`, Hz.
    pub(super) fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let share = self.repeats as f64 / self.samples as f64;
        (share > HELD_SHARE).then_some(Finding::HeldReadings {
            samples: self.repeats,
            of: self.samples,
            rate: sample_rate * (1.0 - share) as f32,
        })
    }
}
