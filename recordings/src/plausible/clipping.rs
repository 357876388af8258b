//! Samples at the end of a sensor's range, as its source says or as the readings show: an axis that
//! comes back to the same largest reading again and again, and stays there for some samples.

use estimator_core::{Decision, Saturation, Validity};

use super::Finding;
use crate::recording::RecordedSample;

/// A sensor may be at the end of its range for this many samples a step: the impact itself.
pub const CLIPPED_A_STEP: u64 = 3;

/// An axis that is at its largest reading in this many separate places is at the end of its range,
const LEAST_VISITS: u64 = 8;

/// if it stays there for this many samples each time, as a steady motion does not,
const LEAST_STAY: u64 = 2;

/// and comes there from below this share of it at once: a smooth motion has a slow top, which looks
/// flat where readings are rounded.
const APPROACH: f32 = 0.99;

/// One of the two sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// The accelerometer.
    Accelerometer,
    /// The gyroscope.
    Gyroscope,
}

impl Sensor {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Accelerometer => "accelerometer",
            Self::Gyroscope => "gyroscope",
        }
    }

    /// The unit of its readings.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Accelerometer => "m/s²",
            Self::Gyroscope => "rad/s",
        }
    }

    /// Below this no sensor's range ends, m/s² or rad/s: 2 g and 125 °/s are the smallest.
    const fn smallest_range(self) -> f32 {
        match self {
            Self::Accelerometer => 19.0,
            Self::Gyroscope => 2.1,
        }
    }
}

/// Counts what is clipped.
#[derive(Default)]
pub(super) struct Clipping {
    sensors: [SensorCount; 2],
    was_stable: bool,
    /// How often the decision has turned to "stable".
    steps: u64,
}

/// Of one sensor.
#[derive(Default)]
struct SensorCount {
    /// Samples that their source says are clipped.
    declared: u64,
    /// The positive and the negative end of each axis.
    ends: [End; 6],
    largest: f32,
}

/// The largest reading of an axis in one direction.
#[derive(Default)]
struct End {
    value: f32,
    samples: u64,
    visits: u64,
    /// The reading before.
    newest: f32,
    is_there: bool,
}

impl End {
    fn add(&mut self, value: f32) {
        if value > self.value {
            *self = Self {
                value,
                newest: self.newest,
                ..Self::default()
            };
        }
        let arrives = value == self.value && self.newest < APPROACH * value;
        self.is_there = arrives || (self.is_there && value == self.value);
        self.visits += u64::from(arrives);
        self.samples += u64::from(self.is_there);
        self.newest = value;
    }
}

impl Clipping {
    pub(super) fn add(&mut self, sample: &RecordedSample) {
        let (accelerometer, gyroscope) = match sample.imu.validity {
            Validity::Saturated(Saturation::Accelerometer) => (true, false),
            Validity::Saturated(Saturation::Gyroscope) => (false, true),
            Validity::Saturated(Saturation::Both) => (true, true),
            _ => (false, false),
        };
        let readings = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        let sensors = self.sensors.iter_mut().zip([accelerometer, gyroscope]);
        for ((sensor, declared), reading) in sensors.zip(readings) {
            sensor.declared += u64::from(declared);
            let axes = [reading.x, reading.y, reading.z];
            let both = axes.into_iter().flat_map(|value| [value, -value]);
            for (end, value) in sensor.ends.iter_mut().zip(both) {
                if value.is_finite() {
                    end.add(value);
                    sensor.largest = sensor.largest.max(value);
                }
            }
        }
    }

    pub(super) fn add_decision(&mut self, decision: Decision) {
        let is_stable = decision == Decision::Stable;
        self.steps += u64::from(is_stable && !self.was_stable);
        self.was_stable = is_stable;
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let names = [Sensor::Accelerometer, Sensor::Gyroscope];
        let counted = names.into_iter().zip(&self.sensors);
        let finding = |(sensor, count): (Sensor, &SensorCount)| {
            let is_end = |end: &&End| {
                end.visits >= LEAST_VISITS
                    && end.samples >= LEAST_STAY * end.visits
                    && end.value >= sensor.smallest_range()
            };
            let seen: u64 = count
                .ends
                .iter()
                .filter(is_end)
                .map(|end| end.samples)
                .sum();
            let samples = seen.max(count.declared);
            let steps = self.steps.max(1);
            (samples > CLIPPED_A_STEP * steps).then_some(Finding::Clips {
                sensor,
                samples,
                steps,
                largest: count.largest,
            })
        };
        counted.filter_map(finding).collect()
    }
}
