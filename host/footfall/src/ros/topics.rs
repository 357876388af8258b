//! Topics of a foot: names and message types.

use std::sync::Arc;

use estimator_core::Timestamp;

use crate::ros::definition::Definition;
use crate::ros::message::{Header, Time};

/// Topic of the diagnostics of all feet.
pub const DIAGNOSTICS: &str = "/diagnostics";

/// Prefix of the id in the name of a node that has no other.
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
            assert_eq!(topic_part(name), part);
        }
    }
}
