//! Readings that are held until a new one comes.

use samples::RecordedSample;

use crate::finding::Finding;

/// Share of repeated readings from which readings count as held. It lies between the share of the GO1, whose IMU was read
/// at 70 Hz and held to 250 Hz, and the shares of all other recordings (`host-tests/tests/go1.rs`).
const HELD_SHARE: f64 = 0.25;

/// Longest run of repeats that counts as held. In longer runs a simulated foot rests, or a sensor is stuck.
const LONGEST_HOLD: u64 = 50;

/// Counts readings that repeat the previous one, until a new one comes.
#[derive(Default)]
pub(crate) struct HeldCheck {
    newest: Option<[f32; 6]>,
    samples: u64,
    /// Length of the current run.
    run: u64,
    repeats: u64,
}

impl HeldCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        let reading = [a.x, a.y, a.z, w.x, w.y, w.z];
        self.samples += 1;
        if self.newest.replace(reading) != Some(reading) {
            if self.run <= LONGEST_HOLD {
                self.repeats += self.run;
            }
            self.run = 0;
        } else if reading.iter().any(|axis| *axis != 0.0) {
            // Repeated zeros do not count, because a simulated foot without gravity reads zeros at perfect rest.
            self.run += 1;
        }
    }

    /// Finding about held readings in rows at `sample_rate`, Hz.
    pub(crate) fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let share = self.repeats as f64 / self.samples as f64;
        (share > HELD_SHARE).then_some(Finding::HeldReadings {
            samples: self.repeats,
            of: self.samples,
            rate: sample_rate * (1.0 - share) as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use estimator_core::{Gravity, Vec3};

    use crate::check;
    use crate::fixtures::{found, held, with_force};

    #[test]
    fn held_readings_are_reported_with_their_number() {
        let mut recording = held(4);
        // The synthetic foot has noise at rest, too.
        for (k, sample) in (0..).zip(&mut recording.samples) {
            sample.imu.angular_rate.0.x = 1e-3 * (k / 4 % 7) as f32;
        }
        let finding = check(&recording).into_iter().find(|f| f.name() == "held_readings");
        let Some(Finding::HeldReadings { samples, of, rate }) = finding else {
            panic!("{finding:?}");
        };
        // The last three have no reading after them.
        assert_eq!((samples, of), (1497, 2000));
        assert!((rate - 50.0).abs() < 1.0, "{rate}");
    }

    #[test]
    fn perfect_rest_is_not_held() {
        let constant = with_force(|_| Vec3::new(0.0, 0.0, 9.81));
        assert!(!found(&constant).contains(&"held_readings"));
        let mut removed = held(4);
        removed.gravity = Gravity::Removed;
        for sample in &mut removed.samples {
            // At rest in three samples out of four.
            let moves = sample.imu.timestamp.as_micros() / 5_000 % 4 == 0;
            let force = if moves { 3.0 } else { 0.0 };
            sample.imu.specific_force.0 = Vec3::new(force, 0.0, 0.0);
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert!(!found(&removed).contains(&"held_readings"));
    }
}
