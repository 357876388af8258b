//! Held readings: rows that come more often than new readings of the sensor.

use crate::samples::recording::RecordedSample;

use super::Finding;

/// Share of repeated readings from which they are held. In recordings with one reading per row, and of simulated
/// robots, it is at most 0.017; on a GO1 read at 70 Hz and held to 250 Hz, 0.72.
const HELD_SHARE: f64 = 0.25;

/// Longest run of repeats that counts as held; in longer ones a simulated foot rests or a sensor is stuck.
const LONGEST_HOLD: u64 = 50;

/// Counts readings that repeat the previous one, until a new one comes.
#[derive(Default)]
pub(super) struct HeldCheck {
    newest: Option<[f32; 6]>,
    samples: u64,
    /// Length of the current run.
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
            // A simulated foot without gravity reads zeros at perfect rest; they are real readings.
            self.run += 1;
        }
    }

    /// Finding about held readings in rows at `sample_rate`, Hz.
    pub(super) fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let share = self.repeats as f64 / self.samples as f64;
        (share > HELD_SHARE).then_some(Finding::HeldReadings {
            samples: self.repeats,
            of: self.samples,
            rate: sample_rate * (1.0 - share) as f32,
        })
    }
}
