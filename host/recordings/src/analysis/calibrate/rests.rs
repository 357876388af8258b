//! Still stretches of a recording, and the sensor's readings in each.

use crate::samples::space::Vector;
use estimator_core::{RestParams, Validity};
use serde::Serialize;

use crate::samples::recording::{RecordedSample, Recording};

/// Least duration of a rest, s.
const SHORTEST: f64 = 1.0;

/// Margin left out at either end, s, in which the sensor is let go or grasped.
const MARGIN: f64 = 0.2;

/// Largest distance of a sample from the running mean, m/s²: twenty times the noise of an LSM6DSOX.
const FORCE_TOLERANCE: f64 = 0.4;

/// Largest distance of the angular rate from its running mean, rad/s.
const RATE_TOLERANCE: f64 = 0.03;

/// Largest difference between the means of a stretch's halves, m/s²; a slow turn exceeds it.
const SWAY: f64 = 0.03;

/// A still stretch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rest {
    /// When it begins on the recording's clock, s.
    pub start_s: f64,
    /// How long it is without its margins, s.
    pub duration_s: f64,
    /// Mean specific force, sensor frame, m/s².
    pub specific_force: [f64; 3],
    /// Mean angular rate, sensor frame, rad/s.
    pub angular_rate: [f64; 3],
}

/// Returns the rests of a recording, in order of time.
#[must_use]
pub fn rests(recording: &Recording) -> Vec<Rest> {
    let mut rests = Vec::new();
    let mut stretch = Stretch::default();
    for sample in &recording.samples {
        if !stretch.takes(sample) {
            rests.extend(stretch.rest(recording.sample_rate));
            stretch = Stretch::default();
            stretch.takes(sample);
        }
    }
    rests.extend(stretch.rest(recording.sample_rate));
    rests
}

fn force(sample: &RecordedSample) -> Vector {
    Vector::from(sample.imu.specific_force.0)
}

fn rate(sample: &RecordedSample) -> Vector {
    Vector::from(sample.imu.angular_rate.0)
}

/// Samples that may form a rest.
#[derive(Default)]
struct Stretch<'a> {
    samples: Vec<&'a RecordedSample>,
    force: Mean,
    rate: Mean,
}

impl<'a> Stretch<'a> {
    /// Adds a valid sample close to those so far; returns whether it was added.
    fn takes(&mut self, sample: &'a RecordedSample) -> bool {
        let (force, rate) = (force(sample), rate(sample));
        let alike = self.samples.is_empty()
            || ((force - self.force.value()).length() <= FORCE_TOLERANCE
                && (rate - self.rate.value()).length() <= RATE_TOLERANCE);
        if !alike || sample.imu.checked_validity() != Validity::Valid {
            return false;
        }
        self.samples.push(sample);
        self.force.add(force);
        self.rate.add(rate);
        true
    }

    fn rest(&self, sample_rate: f32) -> Option<Rest> {
        let margin = (MARGIN * f64::from(sample_rate)).round() as usize;
        let end = self.samples.len().checked_sub(margin)?;
        let inside = self.samples.get(margin..end)?;
        let (first, last) = (inside.first()?, inside.last()?);
        let duration = last.time_s() - first.time_s();
        let force = |samples: &[&RecordedSample]| mean(samples.iter().map(|sample| force(sample)));
        let (early, late) = inside.split_at(inside.len() / 2);
        let rate = mean(inside.iter().map(|sample| rate(sample))).to_array();
        // A larger rate is rotation, because no bias is that large.
        let largest_bias = f64::from(RestParams::DEFAULT.bias_limit);
        let still = duration + 2.0 * MARGIN >= SHORTEST
            && (force(early) - force(late)).length() <= SWAY
            && rate.iter().all(|rate| rate.abs() <= largest_bias);
        still.then(|| Rest {
            start_s: first.time_s(),
            duration_s: duration,
            specific_force: force(inside).to_array(),
            angular_rate: rate,
        })
    }
}

#[derive(Default)]
struct Mean {
    sum: Vector,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: Vector) {
        self.sum = self.sum + value;
        self.count += 1.0;
    }

    fn value(&self) -> Vector {
        let count = self.count.max(1.0);
        Vector::from_array(self.sum.to_array().map(|sum| sum / count))
    }
}

fn mean(values: impl Iterator<Item = Vector>) -> Vector {
    let mut mean = Mean::default();
    values.for_each(|value| mean.add(value));
    mean.value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Vec3;
    use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp};

    /// Returns a recording at 100 Hz.
    fn recording(samples: impl IntoIterator<Item = ([f32; 3], [f32; 3])>) -> Recording {
        let vec3 = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
        let sample = |(k, (force, rate)): (u64, ([f32; 3], [f32; 3]))| RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(10_000 * k),
                specific_force: SpecificForce(vec3(force)),
                angular_rate: AngularRate(vec3(rate)),
                validity: Validity::Valid,
            },
            load: None,
            label: None,
        };
        Recording {
            name: "turned by hand".to_owned(),
            sample_rate: 100.0,
            gravity: Gravity::Included,
            load_title: String::new(),
            samples: (0..).zip(samples).map(sample).collect(),
        }
    }

    fn still(force: [f32; 3], samples: usize) -> Vec<([f32; 3], [f32; 3])> {
        vec![(force, [0.001, 0.0, -0.002]); samples]
    }

    #[test]
    fn rest_ends_at_a_turn_and_short_rests_are_ignored() {
        let mut samples = still([0.0, 0.0, 9.8], 200);
        samples.extend(
            (0..50).map(|k| ([0.2 * k as f32, 0.0, 9.8 - 0.2 * k as f32], [0.0, 1.5, 0.0])),
        );
        samples.extend(still([9.8, 0.0, 0.0], 150));
        samples.extend(still([0.0, 9.8, 0.0], 90));
        let rests = rests(&recording(samples));
        let seen: Vec<_> = rests.iter().map(|rest| rest.specific_force[0] as f32).collect();
        assert_eq!(seen, [0.0, 9.8]);
        assert!((rests[1].start_s - 2.7).abs() < 0.011, "{rests:?}");
        assert!((rests[1].duration_s - 1.1).abs() < 0.011, "{rests:?}");
        assert!((rests[0].angular_rate[2] + 0.002).abs() < 1e-6);
    }

    #[test]
    fn slow_turns_and_invalid_samples_are_not_rests() {
        let turn = (0..2000).map(|k| {
            let angle = 0.01 * k as f32 * 0.02;
            ([0.0, 9.8 * angle.sin(), 9.8 * angle.cos()], [0.02, 0.0, 0.0])
        });
        assert_eq!(rests(&recording(turn)), []);
        let fast = vec![([0.0, 0.0, 9.8], [0.0, 0.0, 0.2]); 1000];
        assert_eq!(rests(&recording(fast)), []);
        let broken = vec![([f32::NAN, 0.0, 9.8], [0.0; 3]); 1000];
        assert_eq!(rests(&recording(broken)), []);
    }
}
