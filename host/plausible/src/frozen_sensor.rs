//! A sensor all of whose readings stay the same.

use estimator_core::{Timestamp, Vec3};
use samples::RecordedSample;

use crate::finding::Finding;

/// Time for which the six readings must stay the same before the sensor counts as frozen, s.
const FROZEN_S: f64 = 2.0;

/// [`FROZEN_S`] if the angular rate is exactly 0, s. It is longer because a foot that is simulated without noise may
/// stand for some seconds.
const FROZEN_WITHOUT_RATE_S: f64 = 10.0;

/// Looks for the longest time in which all six axes stay the same.
#[derive(Default)]
pub(crate) struct FrozenCheck {
    /// Reading of the current run, and the time of its first sample.
    run: Option<([Vec3; 2], Timestamp)>,
    newest: Option<Timestamp>,
    /// Duration in s and end of the longest run.
    longest: Option<(f64, Timestamp)>,
}

impl FrozenCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let now = sample.imu.timestamp;
        let reading = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        self.newest = Some(now);
        match self.run {
            Some((held, since)) if held == reading => {
                let lasts_s = now.micros_since(since).unwrap_or(0) as f64 / 1.0e6;
                let [force, rate] = reading;
                let least_s = if rate == Vec3::ZERO { FROZEN_WITHOUT_RATE_S } else { FROZEN_S };
                let is_longest = self.longest.is_none_or(|(longest_s, _)| lasts_s > longest_s);
                // A simulated foot without gravity reads zeros at perfect rest.
                if lasts_s >= least_s && is_longest && force != Vec3::ZERO {
                    self.longest = Some((lasts_s, now));
                }
            }
            _ => self.run = Some((reading, now)),
        }
    }

    /// Finding about the sensor.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let ((longest_s, end), newest) = (self.longest?, self.newest?);
        let before_end_s = newest.micros_since(end).unwrap_or(0) as f64 / 1.0e6;
        Some(Finding::FrozenSensor { longest_s, before_end_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::check;
    use crate::fixtures::{found, pitching, walk};

    #[test]
    fn frozen_sensor_is_found_with_its_place() {
        let frozen = |range: std::ops::Range<usize>| {
            let mut recording = pitching();
            let held = recording.samples[range.start].imu;
            for sample in &mut recording.samples[range] {
                let imu = &mut sample.imu;
                (imu.specific_force, imu.angular_rate) = (held.specific_force, held.angular_rate);
            }
            check(&recording)
        };
        let all = frozen(0..10_000);
        let at_end = frozen(5_000..10_000);
        let within = frozen(4_000..6_000);
        let finding = |findings: &[Finding]| match findings {
            [Finding::FrozenSensor { longest_s, before_end_s }] => {
                (longest_s.round(), before_end_s.round())
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(finding(&all), (20.0, 0.0));
        assert_eq!(finding(&at_end), (10.0, 0.0));
        assert_eq!(finding(&within), (4.0, 8.0));
        assert!(all[0].to_string().contains("for 20.0 s, up to the end"), "{}", all[0]);
        assert_eq!(frozen(4_000..4_900), []);
    }

    #[test]
    fn perfect_rest_is_frozen_after_ten_seconds_alone() {
        for (seconds, is_found) in [(9, false), (11, true)] {
            let mut recording = walk();
            recording.samples.truncate(200 * seconds);
            for sample in &mut recording.samples {
                sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
                sample.imu.angular_rate.0 = Vec3::ZERO;
            }
            let mut last = *recording.samples.last().expect("samples");
            last.imu.timestamp = Timestamp::from_micros(1_000_000 * seconds as u64);
            recording.samples.push(last);
            assert_eq!(found(&recording).contains(&"frozen_sensor"), is_found);
        }
    }
}
