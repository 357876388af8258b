//! Conversion of a recording to messages on the topics of a foot: its samples, and the estimates from them.
//!
//! | topic | message | published for |
//! |---|---|---|
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | each sample |
//! | `/footfall/FL/load` | `std_msgs/msg/Float64`, N | each sample with a load; NaN once it is no longer known |
//! | `/footfall/FL/imu/validity` | `std_msgs/msg/String` | each sample that is not `valid` |
//! | `/footfall/FL/imu/label` | `std_msgs/msg/Bool`, true for stable | each sample whose truth is known |
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` | each estimate |
//! | `/footfall/FL/contact/probability` | `std_msgs/msg/Float64` | each estimate: P alone; 0 if the estimate is invalid |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped` | each estimate: zero, with its variance |
//! | `/footfall/FL/event` | `footfall_msgs/msg/Event` | each event |
//!
//! Load, validity and label of a sample have its time and precede its IMU message. `imu` is the topic of a foot that
//! streams raw samples; the topics below it carry values without a field in `sensor_msgs/msg/Imu`.

use std::sync::Arc;

use estimator_core::{ContactEstimate, Decision, Load, Timestamp, Validity};
use replay::events::ContactEvent;
use samples::{Label, RecordedSample, phase_code, validity_name};
use wire::Faults;
use wire::pdo::Status;

use crate::ros::message::{ABSENT, Imu, RosContact, RosEvent, RosMessage, vector, zero_velocity};
use crate::ros::topics::{FootTopics, Published};

/// Converter of the samples of a foot.
#[derive(Debug)]
pub struct SampleMessages {
    topics: FootTopics,
    validity: Arc<str>,
    label: Arc<str>,
    /// Whether the previous sample had a load, whose end is published.
    has_load: bool,
}

impl SampleMessages {
    /// Creates a converter for the foot `name`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let topics = FootTopics::of(name);
        Self {
            validity: format!("{}/validity", topics.imu).into(),
            label: format!("{}/label", topics.imu).into(),
            topics,
            has_load: false,
        }
    }

    /// Publishes the load topic even if the first sample has no load, so that in a bag of several feet either all have
    /// the topic or none.
    #[must_use]
    pub fn with_load(self) -> Self {
        Self { has_load: true, ..self }
    }

    /// Returns the messages of a sample acquired at `at` since 1970.
    pub fn messages(&mut self, sample: &RecordedSample, at: Timestamp) -> Vec<Published> {
        let mut published = Vec::new();
        let mut publish = |topic, message| published.push(Published::new(topic, at, message));
        let load = sample.load.filter(|Load(load)| load.is_finite());
        if load.is_some() || self.has_load {
            let load = load.map_or(f32::NAN, |Load(load)| load);
            publish(&self.topics.load, RosMessage::number(load));
        }
        self.has_load = load.is_some();
        if sample.imu.validity != Validity::Valid {
            let name = validity_name(sample.imu.validity).to_owned();
            publish(&self.validity, RosMessage::Text(name));
        }
        if let Some(label) = sample.label {
            publish(&self.label, RosMessage::Bool(label == Label::Stable));
        }
        let imu = Imu {
            header: self.topics.header(at),
            orientation_covariance: ABSENT,
            angular_velocity: vector(sample.imu.angular_rate.0),
            linear_acceleration: vector(sample.imu.specific_force.0),
            ..Imu::default()
        };
        publish(&self.topics.imu, RosMessage::Imu(Box::new(imu)));
        published
    }
}

/// Converter of the estimates of a foot.
#[derive(Debug)]
pub struct EstimateMessages {
    name: String,
    topics: FootTopics,
    sequence: u16,
}

impl EstimateMessages {
    /// Creates a converter for the foot `name`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), topics: FootTopics::of(name), sequence: 0 }
    }

    /// Topics of the messages.
    #[must_use]
    pub fn topics(&self) -> [&Arc<str>; 4] {
        let of = &self.topics;
        [&of.contact, &of.probability, &of.velocity, &of.event]
    }

    /// Returns the message of an event at `stamp` since 1970, which is written at `at`.
    #[must_use]
    pub fn event(&self, event: &ContactEvent, stamp: Timestamp, at: Timestamp) -> Published {
        let message = RosEvent {
            header: self.topics.header(stamp),
            foot: self.name.clone(),
            kind: event.kind as u8 + 1,
            duration: event.duration_us.map_or(f64::NAN, |us| us as f64 * 1.0e-6),
            p_peak: event.peak,
            distance: event.distance_m.unwrap_or(f64::NAN),
        };
        Published::new(&self.topics.event, at, RosMessage::Event(message))
    }

    /// Returns the messages of the next estimate, whose sample was acquired at `stamp` since 1970; they are written
    /// at `at`.
    pub fn messages(
        &mut self,
        estimate: &ContactEstimate,
        stamp: Timestamp,
        at: Timestamp,
    ) -> [Published; 3] {
        let (decision, phase, flags) = (estimate.decision, estimate.phase, estimate.flags);
        let status = Status::new(decision, phase, flags, Faults::NONE);
        let probabilities = &estimate.probabilities;
        let contact = RosContact {
            header: self.topics.header(stamp),
            foot: self.name.clone(),
            node: 0,
            p_stable: probabilities.stable,
            p_tangential: probabilities.tangential,
            p_vertical: probabilities.vertical,
            p_axes: probabilities.axes.to_array(),
            decision: decision == Decision::Stable,
            state: phase_code(phase),
            valid: status.is_valid(),
            flags: flags.bits(),
            sequence: self.sequence,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let velocity = zero_velocity(&contact.header, estimate.velocity_sigma);
        let velocity = RosMessage::Velocity(Box::new(velocity));
        let probability = RosMessage::probability(&contact);
        [
            Published::new(&self.topics.velocity, at, velocity),
            Published::new(&self.topics.probability, at, probability),
            Published::new(&self.topics.contact, at, RosMessage::Contact(contact)),
        ]
    }
}

/// Latest time that a message of ROS 2 can have, µs since 1970: in the year 2038.
pub const LAST_US: i64 = i32::MAX as i64 * 1_000_000;

/// Earliest time to which the clock of a bag is shifted, µs; 0 means that the time is missing.
const FIRST_US: i64 = 1_000_000;

/// Offset to add to a clock that starts at `start_us` so that a bag can represent its times: whole seconds, µs.
/// 0 if `start_us` is positive, as with a clock that counts from 1970.
#[must_use]
pub const fn clock_shift_us(start_us: i64) -> i64 {
    if start_us > 0 {
        return 0;
    }
    let second = 1_000_000;
    (FIRST_US - start_us + second - 1) / second * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::ImuSample;

    #[test]
    fn clock_without_positive_start_is_shifted_by_whole_seconds() {
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
    fn end_of_the_load_is_published_once() {
        let mut samples = SampleMessages::new("FL");
        let mut loads = |load: Option<f32>| -> Vec<f64> {
            let sample =
                RecordedSample { imu: ImuSample::default(), load: load.map(Load), label: None };
            let published = samples.messages(&sample, Timestamp::default());
            let number = |published: Published| match published.message {
                RosMessage::Number(number) => Some(number),
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
