//! Supported messages of ROS 2: their types, and what their fields say.

use crate::ros::{Header, Imu, RosContact, Time, TwistWithCovarianceStamped};

impl Time {
    /// Time of the numbers at the paths of a stamp; zero without them, which means that it is missing.
    pub(super) fn of_numbers(numbers: &[f64]) -> Self {
        match numbers {
            [seconds, nanoseconds] => Self { sec: *seconds as i32, nanosec: *nanoseconds as u32 },
            _ => Self::default(),
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

impl Imu {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "sensor_msgs/msg/Imu";

    /// Message with these accelerations and rates, in the units of its source, and the first covariances of rates and
    /// accelerations, without orientation.
    pub(super) fn of(
        header: Header,
        linear_acceleration: [f64; 3],
        angular_velocity: [f64; 3],
        covariances: [f64; 2],
    ) -> Self {
        let of_first = |first| [first, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        Self {
            header,
            orientation_covariance: of_first(-1.0),
            angular_velocity,
            angular_velocity_covariance: of_first(covariances[0]),
            linear_acceleration,
            linear_acceleration_covariance: of_first(covariances[1]),
            ..Self::default()
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

impl RosContact {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "footfall_msgs/msg/Contact";
}

impl TwistWithCovarianceStamped {
    /// Name of its type.
    pub(super) const TYPE: &'static str = "geometry_msgs/msg/TwistWithCovarianceStamped";
}
