//! Samples at the end of a sensor's range, as declared by the source or as shown by the readings: an axis that
//! repeatedly reaches the same largest reading and stays there for some samples.

use crate::samples::recording::RecordedSample;
use crate::samples::space::components;
use estimator_core::{Decision, Saturation, Validity};

use super::Finding;

/// Number of samples per step that may be at the end of the range: the impact itself.
pub const CLIPPED_A_STEP: u64 = 3;

/// Number of separate visits to the largest reading from which an axis is at the end of its range,
const LEAST_VISITS: u64 = 8;

/// provided that it stays there for this many samples on average, unlike a steady motion,
const LEAST_STAY: u64 = 2;

/// and arrives there in one sample from below this share of it: a smooth motion has a slow peak, which looks flat
/// if readings are rounded.
const APPROACH: f32 = 0.99;

crate::named! {
    /// One of the two sensors.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Sensor {
        /// The accelerometer.
        Accelerometer = "accelerometer",
        /// The gyroscope.
        Gyroscope = "gyroscope",
    }
}

impl Sensor {
    /// Unit of its readings.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Accelerometer => "m/s²",
            Self::Gyroscope => "rad/s",
        }
    }

    /// Smallest range of a sensor, m/s² or rad/s: 2 g and 125 °/s.
    const fn smallest_range(self) -> f32 {
        match self {
            Self::Accelerometer => 19.0,
            Self::Gyroscope => 2.1,
        }
    }
}

/// Counts clipped samples.
#[derive(Default)]
pub(super) struct Clipping {
    sensors: [SensorCount; 2],
    was_stable: bool,
    /// Number of changes of the decision to "stable".
    steps: u64,
}

/// Counts of one sensor.
#[derive(Default)]
struct SensorCount {
    /// Samples declared as clipped by their source.
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
    /// The previous reading.
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
            let axes = components(reading).into_iter();
            let both = axes.flat_map(|value| [value, -value]);
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
        let counted = Sensor::ALL.into_iter().zip(&self.sensors);
        let finding = |(sensor, count): (Sensor, &SensorCount)| {
            let is_end = |end: &&End| {
                end.visits >= LEAST_VISITS
                    && end.samples >= LEAST_STAY * end.visits
                    && end.value >= sensor.smallest_range()
            };
            let ends = count.ends.iter().filter(is_end);
            let seen: u64 = ends.map(|end| end.samples).sum();
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
