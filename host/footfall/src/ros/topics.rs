//! Topics of a foot: names and message types; a message on a topic.

use std::sync::Arc;

use estimator_core::Timestamp;

use crate::ros::message::{Definition, Header, RosMessage, Time};

/// Topic of the diagnostics of all feet.
pub const DIAGNOSTICS: &str = "/diagnostics";

/// Prefix of the id in the name of a node without a name.
pub const NODE: &str = "node_";

/// Default pattern of frame names; `{foot}` is replaced by the foot's name.
pub const FRAME: &str = "footfall_{foot}";

/// Topics of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootTopics {
    /// `footfall_msgs/msg/Contact`.
    pub contact: Arc<str>,
    /// `std_msgs/msg/Float64`.
    pub probability: Arc<str>,
    /// `geometry_msgs/msg/TwistWithCovarianceStamped`.
    pub velocity: Arc<str>,
    /// `std_msgs/msg/Float64`, N.
    pub load: Arc<str>,
    /// `sensor_msgs/msg/Imu`.
    pub imu: Arc<str>,
    /// `footfall_msgs/msg/Event`, of recordings alone.
    pub event: Arc<str>,
    /// Frame of the foot in headers.
    pub frame: Arc<str>,
    /// Hardware id of the board in diagnostics.
    pub hardware: Arc<str>,
}

impl FootTopics {
    /// Creates the topics of the foot `name`.
    #[must_use]
    pub fn of(name: &str) -> Self {
        Self::with_frame(name, FRAME)
    }

    /// Creates the topics with another frame pattern, in which `{foot}` is replaced by the name.
    #[must_use]
    pub fn with_frame(name: &str, frame: &str) -> Self {
        let part = topic_part(name);
        Self {
            contact: format!("/footfall/{part}/contact").into(),
            probability: format!("/footfall/{part}/contact/probability").into(),
            velocity: format!("/footfall/{part}/velocity").into(),
            load: format!("/footfall/{part}/load").into(),
            imu: format!("/footfall/{part}/imu").into(),
            event: format!("/footfall/{part}/event").into(),
            frame: frame.replace("{foot}", &part).into(),
            hardware: FRAME.replace("{foot}", &part).into(),
        }
    }

    /// Returns the header of a message of the foot.
    pub(crate) fn header(&self, stamp: Timestamp) -> Header {
        Header { stamp: Time::from(stamp), frame_id: self.frame.to_string() }
    }

    /// Returns all topics of streaming feet with their message types, including diagnostics.
    #[must_use]
    pub fn all(&self) -> [(&str, Definition); 6] {
        [
            (&self.contact, Definition::CONTACT),
            (&self.probability, Definition::FLOAT64),
            (&self.velocity, Definition::VELOCITY),
            (&self.load, Definition::FLOAT64),
            (&self.imu, Definition::IMU),
            (DIAGNOSTICS, Definition::DIAGNOSTICS),
        ]
    }
}

/// A message with its topic and time of reception.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// The topic.
    pub topic: Arc<str>,
    /// Time of reception of its data.
    pub at: Timestamp,
    /// The message.
    pub message: RosMessage,
}

impl Published {
    pub(crate) fn new(topic: &Arc<str>, at: Timestamp, message: RosMessage) -> Self {
        let topic = Arc::clone(topic);
        Self { topic, at, message }
    }
}

/// Returns a foot name whose topics differ from the topics of these names.
#[must_use]
pub fn unused_name(name: &str, taken: &[impl AsRef<str>]) -> String {
    let is_free = |name: &String| {
        let topics = FootTopics::of(name);
        let mut taken = taken.iter();
        taken.all(|other| FootTopics::of(other.as_ref()) != topics)
    };
    let numbered = (2..).map(|number: u32| format!("{name}_{number}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    names.find(is_free).unwrap_or_else(|| name.to_owned())
}

/// Converts a name to a part of a topic: letters, digits and single underscores, starting with a letter. A
/// part that starts with an underscore would be hidden.
fn topic_part(name: &str) -> String {
    let mut part = String::with_capacity(name.len());
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            part.push(c);
        } else if !part.is_empty() && !part.ends_with('_') {
            part.push('_');
        }
    }
    if part.starts_with(|c: char| c.is_ascii_alphabetic()) { part } else { format!("foot_{part}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foot_names_become_valid_topic_parts() {
        for (name, part) in [
            ("FL", "FL"),
            ("node_33", "node_33"),
            ("/dev/ttyACM0", "dev_ttyACM0"),
            ("walk__2.csv", "walk_2_csv"),
            ("2", "foot_2"),
            ("", "foot_"),
        ] {
            let topic = format!("/footfall/{part}/contact");
            assert_eq!(*FootTopics::of(name).contact, topic, "{name}");
        }
    }

    #[test]
    fn names_with_the_same_topics_are_numbered() {
        let mut names: Vec<String> = Vec::new();
        for name in ["front left", "front_left", "左前", "右前", "fl"] {
            names.push(unused_name(name, &names));
        }
        assert_eq!(names, ["front left", "front_left_2", "左前", "右前_2", "fl"]);
    }
}
