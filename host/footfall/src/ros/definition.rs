//! Message definitions as stored in recordings: the definition of the message, then those of nested messages,
//! each after a line of `=` and its name.
//!
//! Definitions other than footfall's are interfaces of ROS 2, with names, types and order of their fields.

use crate::ros::message::RosMessage;

/// Separator between definitions.
const BETWEEN: &str =
    "\n================================================================================\nMSG: ";

/// Names and fields of nested messages.
const NESTED: [(&str, &str); 10] = [
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"),
    ("diagnostic_msgs/DiagnosticStatus", STATUS),
    ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    ("inekf_msgs/Contact", NUMBERED_CONTACT),
    ("custom_sensor_msgs/Contact", NUMBERED_CONTACT),
];
const IMU: &str = "std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
";
const STATUS: &str = "byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values
";
const NUMBERED_CONTACT: &str = "int32 id\nbool indicator\n";

/// `unitree_go/msg/LowState` with the types in it.
const LOW_STATE: &str = include_str!("../../../recordings/src/input/bag/definition/low_state.msg");

/// Definition of a contact, from the interface package.
pub const CONTACT: &str = include_str!("../../../../ros2/footfall_msgs/msg/Contact.msg");

/// Definition of an event, from the interface package.
pub const EVENT: &str = include_str!("../../../../ros2/footfall_msgs/msg/Event.msg");

/// Definition of a message type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Name of the type: `package/msg/Name`.
    pub name: &'static str,
    /// Fields of the message.
    own: &'static str,
}

impl Definition {
    const fn new(name: &'static str, own: &'static str) -> Self {
        Self { name, own }
    }

    /// Contact.
    pub const CONTACT: Self = Self::new("footfall_msgs/msg/Contact", CONTACT);
    /// IMU sample.
    pub const IMU: Self = Self::new("sensor_msgs/msg/Imu", IMU);
    /// Velocity.
    pub const VELOCITY: Self = Self::new(
        "geometry_msgs/msg/TwistWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n",
    );
    /// Number.
    pub const FLOAT64: Self = Self::new("std_msgs/msg/Float64", "float64 data\n");
    /// Diagnostics.
    pub const DIAGNOSTICS: Self = Self::new(
        "diagnostic_msgs/msg/DiagnosticArray",
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
    );

    /// Returns the definition of a message.
    #[must_use]
    pub const fn of(message: &RosMessage) -> Self {
        match message {
            RosMessage::Contact(_) => Self::CONTACT,
            RosMessage::Event(_) => Self::new("footfall_msgs/msg/Event", EVENT),
            RosMessage::Imu(_) => Self::IMU,
            RosMessage::Velocity(_) => Self::VELOCITY,
            RosMessage::Number(_) => Self::FLOAT64,
            RosMessage::Text(_) => Self::new("std_msgs/msg/String", "string data\n"),
            RosMessage::Bool(_) => Self::new("std_msgs/msg/Bool", "bool data\n"),
            RosMessage::Diagnostics(_) => Self::DIAGNOSTICS,
            RosMessage::Champ(_) => Self::new(
                "champ_msgs/msg/ContactsStamped",
                "std_msgs/Header header\nbool[] contacts\n",
            ),
            RosMessage::Pronto(_) => Self::new(
                "pronto_msgs/msg/QuadrupedStance",
                "std_msgs/Header header\nfloat32 lf\nfloat32 rf\nfloat32 lh\nfloat32 rh\n",
            ),
            RosMessage::Inekf(_) => Self::new(
                "inekf_msgs/msg/ContactArray",
                "std_msgs/Header header\ninekf_msgs/Contact[] contacts\n",
            ),
            RosMessage::Drift(_) => Self::new(
                "custom_sensor_msgs/msg/ContactArray",
                "std_msgs/Header header\ncustom_sensor_msgs/Contact[] contacts\n",
            ),
            RosMessage::Muse(_) => Self::new(
                "state_estimator_msgs/msg/ContactDetection",
                "std_msgs/Header header\nbool stance_lf\nbool stance_rf\nbool stance_lh\nbool stance_rh\n",
            ),
            RosMessage::Unitree(_) => Self::new("unitree_go/msg/LowState", LOW_STATE),
        }
    }

    /// Package, such as `std_msgs`, and name in it, such as `Float64`.
    #[must_use]
    pub fn package_and_name(self) -> (&'static str, &'static str) {
        self.name.split_once("/msg/").unwrap_or_default()
    }

    /// Complete text, with nested definitions.
    #[must_use]
    pub fn text(self) -> String {
        let mut nested = Vec::new();
        add_nested(self.own, &mut nested);
        let nested = nested.into_iter();
        let nested = nested.map(|(name, text)| format!("{BETWEEN}{name}\n{text}"));
        self.own.to_owned() + &nested.collect::<String>()
    }
}

/// Adds the nested messages of fields, each once and followed by those in it.
fn add_nested(fields: &str, to: &mut Vec<(&'static str, &'static str)>) {
    for line in fields.lines() {
        let of_type = line.split([' ', '[']).next();
        let nested = NESTED.iter().find(|(name, _)| of_type == Some(name));
        if let Some(nested) = nested.filter(|nested| !to.contains(nested)) {
            to.push(*nested);
            add_nested(nested.1, to);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flag, Flags, Phase};
    use recordings::events::EventKind;

    /// Value of a constant of a definition.
    fn constant(definition: &str, name: &str) -> Option<u8> {
        let line = definition.lines().find_map(|line| line.strip_prefix(&format!("uint8 {name}=")));
        line.and_then(|value| value.parse().ok())
    }

    #[test]
    fn definition_contains_every_phase_and_flag() {
        for phase in Phase::ALL {
            let name = format!("STATE_{}", phase.name().to_uppercase());
            let number = recordings::samples::phase::code_of(phase);
            assert_eq!(constant(CONTACT, &name), Some(number), "{name}");
        }
        for flag in Flag::ALL {
            let name = format!("FLAG_{}", flag.name().to_uppercase());
            assert_eq!(constant(CONTACT, &name), Some(Flags::NONE.with(flag).bits()), "{name}");
        }
    }

    #[test]
    fn definition_contains_every_kind_of_event() {
        for kind in EventKind::ALL {
            let name = kind.name().to_uppercase();
            let number = kind as u8 + 1;
            assert_eq!(constant(EVENT, &name), Some(number), "{name}");
        }
    }
}
