//! Samples of an IMU that were recorded become messages on topics: those that a foot which streams its samples
//! has, and beside them what `sensor_msgs/msg/Imu` has no field for.
//!
//! | topic | message | of |
//! |---|---|---|
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | each sample |
//! | `/footfall/FL/load` | `std_msgs/msg/Float64`, N | each sample with a load; not a number where it is not known any more |
//! | `/footfall/FL/imu/validity` | `std_msgs/msg/String` | each sample that is not `valid` |
//! | `/footfall/FL/imu/label` | `std_msgs/msg/Bool`, true for stable | each sample whose truth is known |
//!
//! All that is about a sample has its time, and comes before it.

use std::sync::Arc;

use estimator_core::{Load, Timestamp, Validity};
use recordings::recording::{Label, RecordedSample};
use recordings::validity::name_of;

use crate::bridge::Published;
use crate::foot::{ABSENT, vector};
use crate::message::{Bool, Float64, Header, Imu, Message, Text, Time};
use crate::topics::Topics;

/// The last time that a message of ROS 2 can have, µs since 1970: in the year 2038.
pub const LAST_US: i64 = i32::MAX as i64 * 1_000_000;

/// The earliest time that a clock of a bag is moved to, µs: 0 says that there is no time.
const FIRST_US: i64 = 1_000_000;

/// What is to be added to a clock that says `start_us` first, so that a bag can have its times: whole seconds, µs.
/// 0 where it counts from 1970 or any other time before.
#[must_use]
pub const fn clock_shift_us(start_us: i64) -> i64 {
    if start_us > 0 {
        return 0;
    }
    let second = 1_000_000;
    (FIRST_US - start_us + second - 1) / second * second
}

/// The samples of a foot on their way to a bag.
#[derive(Debug)]
pub struct Samples {
    topics: Topics,
    validity: Arc<str>,
    label: Arc<str>,
    has_load: bool,
}

impl Samples {
    /// Of a foot of this name.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let topics = Topics::of(name);
        Self {
            validity: format!("{}/validity", topics.imu).into(),
            label: format!("{}/label", topics.imu).into(),
            topics,
            has_load: false,
        }
    }

    /// The same with a topic of its load, whether there is one or not: of several feet all have it or none.
    #[must_use]
    pub fn with_load(self) -> Self {
        Self {
            has_load: true,
            ..self
        }
    }

    /// The topics of the foot.
    #[must_use]
    pub const fn topics(&self) -> &Topics {
        &self.topics
    }

    /// The messages of a sample that was acquired at this time since 1970.
    pub fn messages(&mut self, sample: &RecordedSample, at: Timestamp) -> Vec<Published> {
        let mut published = Vec::new();
        let mut publish = |topic: &Arc<str>, message| {
            published.push(Published {
                topic: Arc::clone(topic),
                at,
                message,
            });
        };
        let load = sample.load.filter(|Load(load)| load.is_finite());
        if load.is_some() || self.has_load {
            let data = load.map_or(f64::NAN, |Load(load)| f64::from(load));
            publish(&self.topics.load, Message::Number(Float64 { data }));
        }
        self.has_load = load.is_some();
        if sample.imu.validity != Validity::Valid {
            let data = name_of(sample.imu.validity).to_owned();
            publish(&self.validity, Message::Text(Text { data }));
        }
        if let Some(label) = sample.label {
            let data = label == Label::Stable;
            publish(&self.label, Message::Bool(Bool { data }));
        }
        let imu = Imu {
            header: Header {
                stamp: Time::from(at),
                frame_id: self.topics.frame.as_ref().to_owned(),
            },
            orientation_covariance: ABSENT,
            angular_velocity: vector(sample.imu.angular_rate.0),
            linear_acceleration: vector(sample.imu.specific_force.0),
            ..Imu::default()
        };
        publish(&self.topics.imu, Message::Imu(Box::new(imu)));
        published
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::ImuSample;

    #[test]
    fn a_clock_that_begins_before_1970_is_moved_by_whole_seconds() {
        for (start_us, shift_us) in [
            (0, 1_000_000),
            (-1, 2_000_000),
            (-2_500_000, 4_000_000),
            (1, 0),
            (1_700_000_000_000_000, 0),
        ] {
            assert_eq!(clock_shift_us(start_us), shift_us, "{start_us}");
        }
    }

    #[test]
    fn a_load_that_ends_is_said_once() {
        let mut samples = Samples::new("FL");
        let mut loads = |load: Option<f32>| -> Vec<f64> {
            let sample = RecordedSample {
                imu: ImuSample::default(),
                load: load.map(Load),
                label: None,
            };
            let published = samples.messages(&sample, Timestamp::default());
            let number = |published: Published| match published.message {
                Message::Number(Float64 { data }) => Some(data),
                _ => None,
            };
            published.into_iter().filter_map(number).collect()
        };
        assert!(loads(None).is_empty(), "none was known");
        assert_eq!(loads(Some(2.5)), [2.5]);
        assert!(loads(None)[0].is_nan());
        assert!(loads(None).is_empty());
    }
}
