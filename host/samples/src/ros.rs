//! Messages of ROS 2 sent by feet and found in recordings, with fields in the order of their definitions.
//!
//! Source of the messages other than footfall's: <https://github.com/ros2/common_interfaces>.

use std::fmt;

use estimator_core::Timestamp;
use serde::de::{Deserializer, Visitor};
use serde::{Deserialize, Serialize};

/// `builtin_interfaces/msg/Time`: since 1970.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
pub struct Time {
    /// s.
    pub sec: i32,
    /// ns of a second.
    pub nanosec: u32,
}

impl Time {
    /// Returns the time this many ns later, or earlier if they are negative.
    #[must_use]
    pub fn plus_ns(self, ns: i16) -> Self {
        let total = i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec) + i64::from(ns);
        Self {
            sec: i32::try_from(total.div_euclid(1_000_000_000)).unwrap_or(i32::MAX),
            nanosec: total.rem_euclid(1_000_000_000) as u32,
        }
    }
}

impl From<Timestamp> for Time {
    fn from(time: Timestamp) -> Self {
        let micros = time.as_micros();
        Self {
            sec: i32::try_from(micros / 1_000_000).unwrap_or(i32::MAX),
            nanosec: (micros % 1_000_000) as u32 * 1000,
        }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// In which frame.
    #[serde(deserialize_with = "text")]
    pub frame_id: String,
}

/// `sensor_msgs/msg/Imu`. A covariance whose first number is −1 means that there is no such value. A covariance of
/// zeros means that it is unknown.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Imu {
    /// When the sample was acquired.
    pub header: Header,
    /// Foot → world: x, y, z, w.
    pub orientation: [f64; 4],
    /// Covariance of the orientation.
    pub orientation_covariance: [f64; 9],
    /// rad/s.
    pub angular_velocity: [f64; 3],
    /// Covariance of the angular velocity.
    pub angular_velocity_covariance: [f64; 9],
    /// m/s², gravity included.
    pub linear_acceleration: [f64; 3],
    /// Covariance of the acceleration.
    pub linear_acceleration_covariance: [f64; 9],
}

/// `geometry_msgs/msg/TwistWithCovarianceStamped`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct TwistWithCovarianceStamped {
    /// When the sample was acquired.
    pub header: Header,
    /// Velocity, m/s, and rates, rad/s.
    pub twist: [f64; 6],
    /// Covariance, row by row: first of the velocities along x, y and z, (m/s)², then of the rates about them, (rad/s)².
    pub covariance: [[f64; 6]; 6],
}

/// `footfall_msgs/msg/Contact`; `ros2/footfall_msgs/msg/Contact.msg` describes its fields.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[expect(missing_docs, reason = "the definition has them")]
pub struct RosContact {
    pub header: Header,
    #[serde(deserialize_with = "text")]
    pub foot: String,
    pub node: u8,
    pub p_stable: f32,
    pub p_tangential: f32,
    pub p_vertical: f32,
    pub p_axes: [f32; 6],
    pub decision: bool,
    pub state: u8,
    pub valid: bool,
    pub flags: u8,
    pub sequence: u16,
}

impl Time {
    /// Returns the time of the numbers at the paths of a stamp; zero without them, which means that it is missing.
    #[must_use]
    pub fn of_numbers(numbers: &[f64]) -> Self {
        match numbers {
            [seconds, nanoseconds] => Self { sec: *seconds as i32, nanosec: *nanoseconds as u32 },
            _ => Self::default(),
        }
    }

    /// Returns the time in µs, rounded; `None` for zero, which means that the stamp is missing.
    #[must_use]
    pub fn micros(self) -> Option<i64> {
        let Self { sec, nanosec } = self;
        if (sec, nanosec) == (0, 0) {
            return None;
        }
        Some(1_000_000 * i64::from(sec) + (i64::from(nanosec) + 500) / 1000)
    }
}

impl Imu {
    /// Name of its type.
    pub const TYPE: &'static str = "sensor_msgs/msg/Imu";

    /// Returns the message with these accelerations and rates, in the units of its source, and the first covariances of rates and
    /// accelerations, without orientation.
    #[must_use]
    pub fn of(
        header: Header,
        linear_acceleration: [f64; 3],
        angular_velocity: [f64; 3],
        covariances: [f64; 2],
    ) -> Self {
        let with_first = |first| [first, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        Self {
            header,
            orientation_covariance: with_first(-1.0),
            angular_velocity,
            angular_velocity_covariance: with_first(covariances[0]),
            linear_acceleration,
            linear_acceleration_covariance: with_first(covariances[1]),
            ..Self::default()
        }
    }

    /// Returns the orientation x, y, z, w; `None` if it is marked as missing.
    #[must_use]
    pub fn orientation(&self) -> Option<[f64; 4]> {
        (self.orientation_covariance[0] != -1.0).then_some(self.orientation)
    }

    /// Returns whether the message has rates. A first covariance of -1 marks them as missing.
    #[must_use]
    pub fn has_rates(&self) -> bool {
        self.angular_velocity_covariance[0] != -1.0
    }

    /// Returns whether it has accelerations.
    #[must_use]
    pub fn has_accelerations(&self) -> bool {
        self.linear_acceleration_covariance[0] != -1.0
    }
}

impl RosContact {
    /// Name of its type.
    pub const TYPE: &'static str = "footfall_msgs/msg/Contact";
}

impl TwistWithCovarianceStamped {
    /// Name of its type.
    pub const TYPE: &'static str = "geometry_msgs/msg/TwistWithCovarianceStamped";
}

/// Reads a text of any content, which in CDR is a byte count followed by the bytes. Bytes that are not UTF-8 are replaced.
fn text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    deserializer.deserialize_bytes(TextVisitor)
}

struct TextVisitor;

impl Visitor<'_> for TextVisitor {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_bytes<E>(self, bytes: &[u8]) -> Result<String, E> {
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(text).into_owned())
    }
}
