//! Messages that arrive one by one, as on a topic of ROS 2, decoded like the messages of a bag.

use std::collections::BTreeSet;

use options::{LoadTopic, Mapping};
use samples::ros::{Imu, Time};
use stored::error::{InputError, MessageProblem, Place, Problem};

use crate::fields::Fields;
use crate::loads::LoadPlace;
use crate::messages::{Channel, decode};
use crate::selection::{is_imu, last_word, names_of, trunks};

pub use crate::fields::is_low_state;
pub use crate::selection::is_trunk;

/// Origin of messages in errors.
const DOMAIN: &str = "ROS 2";

/// Decoder of the samples of an IMU in the messages of a topic.
pub struct ImuDecoder(Layout);

enum Layout {
    /// `sensor_msgs/msg/Imu`.
    Imu,
    /// A message of another type, or a part of one.
    Fields(Box<Fields>),
}

/// Sample of an IMU as its message has it.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuMessage {
    /// Time of the header, µs; `None` if it is zero, which means that it is missing.
    pub stamp_us: Option<i64>,
    /// Difference between the time of the header and `stamp_us`, −500 to 499 ns.
    pub stamp_rest_ns: i16,
    /// Frame of the header.
    pub frame: String,
    /// Readings in the order of [`Axis::ALL`](estimator_core::Axis::ALL), in the units of the message; NaN if they are
    /// marked as missing.
    pub readings: [f64; 6],
}

impl ImuDecoder {
    /// Creates the decoder of a channel. `part` is the part of the message that is an IMU, such as `imu[0]`, and empty for
    /// the whole message. `mapping` names the six axes in messages of another type.
    ///
    /// # Errors
    /// The messages have no six axes, or no definition of them is known.
    pub fn of(channel: &Channel, part: &str, mapping: &Mapping) -> Result<Self, InputError> {
        if is_imu(channel) && part.is_empty() {
            return Ok(Self(Layout::Imu));
        }
        let fields = Fields::of(channel, part, mapping);
        let fields = fields.map_err(|problem| InputError {
            file: DOMAIN.to_owned(),
            place: Place::Topic(channel.topic.clone()),
            problem: Problem::ImuFields { message: channel.message.clone(), problem },
        })?;
        Ok(Self(Layout::Fields(Box::new(fields))))
    }

    /// Decodes a message in CDR, with its encoding in the first four bytes.
    ///
    /// # Errors
    /// The message is not of its type.
    pub fn decode(&self, payload: &[u8]) -> Result<ImuMessage, MessageProblem> {
        let imu: Imu = match &self.0 {
            Layout::Imu => decode(payload)?,
            Layout::Fields(fields) => fields.imu(payload)?,
        };
        let known = |axes: [f64; 3], are_there| if are_there { axes } else { [f64::NAN; 3] };
        let [ax, ay, az] = known(imu.linear_acceleration, imu.has_accelerations());
        let [wx, wy, wz] = known(imu.angular_velocity, imu.has_rates());
        Ok(ImuMessage {
            stamp_us: imu.header.stamp.micros(),
            stamp_rest_ns: rest_ns(imu.header.stamp),
            readings: [ax, ay, az, wx, wy, wz],
            frame: imu.header.frame_id,
        })
    }
}

/// Returns the part of a time that is lost when the time is rounded to µs, ns.
const fn rest_ns(time: Time) -> i16 {
    let rest = (time.nanosec % 1000) as i16;
    if rest < 500 { rest } else { rest - 1000 }
}

/// Decoder of a load in the messages of a topic.
pub struct LoadDecoder(LoadPlace);

impl LoadDecoder {
    /// Creates the decoder of a channel, for the number in its messages that `load` names.
    ///
    /// # Errors
    /// There is no such number, or no definition of the messages is known.
    pub fn of(channel: &Channel, load: &LoadTopic) -> Result<Self, InputError> {
        let place = LoadPlace::of(channel, load.field.as_deref());
        place.map(Self).map_err(|problem| {
            let (load, message) = (load.clone(), channel.message.clone());
            InputError::of_file(DOMAIN, Problem::LoadField { load, message, problem })
        })
    }

    /// Decodes a message in CDR, with its encoding in the first four bytes: the load in the unit of the message.
    ///
    /// # Errors
    /// The message is not of its type.
    pub fn decode(&self, payload: &[u8]) -> Result<f64, MessageProblem> {
        Ok(self.0.decode(payload)?.value)
    }
}

/// Topics of IMUs as feet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicNames {
    /// Topics of feet with the names of the feet, in the order of the topics.
    pub feet: Vec<(String, String)>,
    /// Topics that are probably of the robot's trunk.
    pub trunks: Vec<String>,
}

/// Returns the feet among topics of IMUs, named as in a bag with these topics. A topic whose words name a trunk is
/// no foot.
#[must_use]
pub fn name_topics(topics: &BTreeSet<String>) -> TopicNames {
    let all: Vec<String> = topics.iter().cloned().collect();
    let trunks: Vec<String> = match &all[..] {
        [only] if is_trunk(only, "", false) => vec![only.clone()],
        _ => trunks(&all).cloned().collect(),
    };
    let feet: Vec<String> = all.iter().filter(|topic| !trunks.contains(topic)).cloned().collect();
    let names = names_of(&feet, topics);
    let named = feet.into_iter().zip(names).map(|(topic, name)| {
        let name = name.or_else(|| last_word(&topic));
        let name = name.unwrap_or_else(|| topic.trim_matches('/').to_owned());
        (topic, name)
    });
    TopicNames { feet: named.collect(), trunks }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(topics: &[&str]) -> (Vec<String>, Vec<String>) {
        let topics = topics.iter().map(|topic| (*topic).to_owned()).collect();
        let TopicNames { feet, trunks } = name_topics(&topics);
        (feet.into_iter().map(|(_, name)| name).collect(), trunks)
    }

    #[test]
    fn topics_of_feet_are_named_without_the_trunk() {
        let four = ["/lf_foot/imu", "/lh_foot/imu", "/rf_foot/imu", "/rh_foot/imu"];
        let feet = ["lf_foot", "lh_foot", "rf_foot", "rh_foot"].map(str::to_owned).to_vec();
        assert_eq!(names(&four), (feet.clone(), Vec::new()));
        let with_trunk = [&four[..], &["/trunk/imu"]].concat();
        assert_eq!(names(&with_trunk), (feet, vec!["/trunk/imu".to_owned()]));
        assert_eq!(names(&["/left_foot/imu"]).0, ["left_foot"]);
        assert_eq!(names(&["/imu"]).0, ["imu"]);
        assert_eq!(names(&["/trunk/imu"]), (Vec::new(), vec!["/trunk/imu".to_owned()]));
    }
}
