//! Supported messages of ROS 2, field by field as in their definitions. Source:
//! <https://github.com/ros2/common_interfaces>.

use serde::Deserialize;

use super::cdr::Text;

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Time {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

impl Time {
    /// Time of the numbers at the paths of a stamp; zero without them, which means that it is missing.
    pub(super) fn of_numbers(numbers: &[f64]) -> Self {
        match numbers {
            [seconds, nanoseconds] => Self {
                sec: *seconds as i32,
                nanosec: *nanoseconds as u32,
            },
            _ => Self { sec: 0, nanosec: 0 },
        }
    }

    /// Time in µs, rounded; `None` for zero, which means that the stamp is missing.
    pub(super) fn micros(self) -> Option<i64> {
        let Self { sec, nanosec } = self;
        if (sec, nanosec) == (0, 0) {
            return None;
        }
        Some(1_000_000 * i64::from(sec) + (i64::from(nanosec) + 500) / 1000)
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: Text,
}

/// `sensor_msgs/msg/Imu`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Imu {
    pub(super) header: Header,
    orientation: [f64; 4],
    orientation_covariance: [f64; 9],
    pub(super) angular_velocity: [f64; 3],
    angular_velocity_covariance: [f64; 9],
    pub(super) linear_acceleration: [f64; 3],
    linear_acceleration_covariance: [f64; 9],
}

impl Imu {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "sensor_msgs/msg/Imu";

    /// Message with these accelerations and rates, in the units of its source, and the first covariances of rates and
    /// accelerations, without orientation.
    pub(super) fn of(
        header: Header,
        accelerations: [f64; 3],
        rates: [f64; 3],
        covariances: [f64; 2],
    ) -> Self {
        let of_first = |first| [first, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        Self {
            header,
            orientation: [0.0; 4],
            orientation_covariance: of_first(-1.0),
            angular_velocity: rates,
            angular_velocity_covariance: of_first(covariances[0]),
            linear_acceleration: accelerations,
            linear_acceleration_covariance: of_first(covariances[1]),
        }
    }

    /// Orientation x, y, z, w; `None` if it is marked as missing.
    pub(super) fn orientation(&self) -> Option<[f64; 4]> {
        (self.orientation_covariance[0] != -1.0).then_some(self.orientation)
    }

    /// Returns whether it has rates: -1 as the first covariance marks them as missing.
    pub(super) fn has_rates(&self) -> bool {
        self.angular_velocity_covariance[0] != -1.0
    }

    /// Returns whether it has accelerations.
    pub(super) fn has_accelerations(&self) -> bool {
        self.linear_acceleration_covariance[0] != -1.0
    }
}

/// `footfall_msgs/msg/Contact`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Contact {
    pub(super) header: Header,
    _foot: Text,
    _node: u8,
    pub(super) p_stable: f32,
    pub(super) p_tangential: f32,
    pub(super) p_vertical: f32,
    pub(super) p_axes: [f32; 6],
    pub(super) decision: bool,
    pub(super) state: u8,
    pub(super) valid: bool,
    pub(super) flags: u8,
    _sequence: u16,
}

impl Contact {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "footfall_msgs/msg/Contact";
}

/// `geometry_msgs/msg/TwistWithCovarianceStamped`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct TwistWithCovarianceStamped {
    pub(super) header: Header,
    _twist: [f64; 6],
    /// Of x, y, z and the rates about them, (m/s)² and (rad/s)².
    pub(super) covariance: [[f64; 6]; 6],
}

impl TwistWithCovarianceStamped {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "geometry_msgs/msg/TwistWithCovarianceStamped";
}
