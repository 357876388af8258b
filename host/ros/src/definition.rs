//! Message definitions as stored in recordings: the definition of the message, then those of nested messages,
//! each after a line of `=` and its name.
//!
//! Definitions other than footfall's are interfaces of ROS 2, with names, types and order of their fields.

use crate::message::RosMessage;

/// Separator between definitions.
const BETWEEN: &str =
    "\n================================================================================\nMSG: ";

/// Names and fields of the messages in a header.
const IN_HEADER: [(&str, &str); 2] = [
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
];
const QUATERNION: &str = "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const VECTOR3: &str = "float64 x\nfloat64 y\nfloat64 z\n";
const IMU: &str = "std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
";
const TWIST: &str = "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";
const TWIST_WITH_COVARIANCE: &str = "geometry_msgs/Twist twist\nfloat64[36] covariance\n";
const TWIST_WITH_COVARIANCE_STAMPED: &str =
    "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n";

const KEY_VALUE: &str = "string key\nstring value\n";
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
const DIAGNOSTICS: &str = "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n";

const CONTACTS_STAMPED: &str = "std_msgs/Header header\nbool[] contacts\n";
const QUADRUPED_STANCE: &str =
    "std_msgs/Header header\nfloat32 lf\nfloat32 rf\nfloat32 lh\nfloat32 rh\n";

const NUMBERED_CONTACT: &str = "int32 id\nbool indicator\n";
const CONTACT_DETECTION: &str =
    "std_msgs/Header header\nbool stance_lf\nbool stance_rf\nbool stance_lh\nbool stance_rh\n";

/// `unitree_go/msg/LowState` with the types in it.
const LOW_STATE: &str = include_str!("../../recordings/src/input/bag/definition/low_state.msg");

/// Definition of a contact, from the interface package.
pub const CONTACT: &str = include_str!("../../../ros2/footfall_msgs/msg/Contact.msg");

/// Definition of an event, from the interface package.
pub const EVENT: &str = include_str!("../../../ros2/footfall_msgs/msg/Event.msg");

/// Definition of a message type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Name of the type: `package/msg/Name`.
    pub name: &'static str,
    /// Fields of the message.
    own: &'static str,
    /// Names and fields of nested messages, but for those of a header.
    others: &'static [(&'static str, &'static str)],
}

impl Definition {
    const fn new(
        name: &'static str,
        own: &'static str,
        others: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self { name, own, others }
    }

    /// Contact.
    pub const CONTACT: Self = Self::new("footfall_msgs/msg/Contact", CONTACT, &[]);
    /// Event.
    pub const EVENT: Self = Self::new("footfall_msgs/msg/Event", EVENT, &[]);
    /// IMU sample.
    pub const IMU: Self = Self::new(
        "sensor_msgs/msg/Imu",
        IMU,
        &[
            ("geometry_msgs/Quaternion", QUATERNION),
            ("geometry_msgs/Vector3", VECTOR3),
        ],
    );
    /// Velocity.
    pub const VELOCITY: Self = Self::new(
        "geometry_msgs/msg/TwistWithCovarianceStamped",
        TWIST_WITH_COVARIANCE_STAMPED,
        &[
            ("geometry_msgs/TwistWithCovariance", TWIST_WITH_COVARIANCE),
            ("geometry_msgs/Twist", TWIST),
            ("geometry_msgs/Vector3", VECTOR3),
        ],
    );
    /// Number.
    pub const FLOAT64: Self = Self::new("std_msgs/msg/Float64", "float64 data\n", &[]);
    /// Text.
    pub const STRING: Self = Self::new("std_msgs/msg/String", "string data\n", &[]);
    /// Truth value.
    pub const BOOL: Self = Self::new("std_msgs/msg/Bool", "bool data\n", &[]);
    /// Diagnostics.
    pub const DIAGNOSTICS: Self = Self::new(
        "diagnostic_msgs/msg/DiagnosticArray",
        DIAGNOSTICS,
        &[
            ("diagnostic_msgs/DiagnosticStatus", STATUS),
            ("diagnostic_msgs/KeyValue", KEY_VALUE),
        ],
    );
    /// All feet, for champ.
    pub const CHAMP: Self = Self::new("champ_msgs/msg/ContactsStamped", CONTACTS_STAMPED, &[]);
    /// All feet, for pronto.
    pub const PRONTO: Self = Self::new("pronto_msgs/msg/QuadrupedStance", QUADRUPED_STANCE, &[]);
    /// All feet, for `InEKF`.
    pub const INEKF: Self = Self::new(
        "inekf_msgs/msg/ContactArray",
        "std_msgs/Header header\ninekf_msgs/Contact[] contacts\n",
        &[("inekf_msgs/Contact", NUMBERED_CONTACT)],
    );
    /// All feet, for DRIFT.
    pub const DRIFT: Self = Self::new(
        "custom_sensor_msgs/msg/ContactArray",
        "std_msgs/Header header\ncustom_sensor_msgs/Contact[] contacts\n",
        &[("custom_sensor_msgs/Contact", NUMBERED_CONTACT)],
    );
    /// All feet, for MUSE.
    pub const MUSE: Self = Self::new(
        "state_estimator_msgs/msg/ContactDetection",
        CONTACT_DETECTION,
        &[],
    );
    /// All feet, as Unitree has them.
    pub const UNITREE: Self = Self::new("unitree_go/msg/LowState", LOW_STATE, &[]);

    /// Returns the definition of a message.
    #[must_use]
    pub const fn of(message: &RosMessage) -> Self {
        match message {
            RosMessage::Contact(_) => Self::CONTACT,
            RosMessage::Event(_) => Self::EVENT,
            RosMessage::Imu(_) => Self::IMU,
            RosMessage::Velocity(_) => Self::VELOCITY,
            RosMessage::Number(_) => Self::FLOAT64,
            RosMessage::Text(_) => Self::STRING,
            RosMessage::Bool(_) => Self::BOOL,
            RosMessage::Diagnostics(_) => Self::DIAGNOSTICS,
            RosMessage::Champ(_) => Self::CHAMP,
            RosMessage::Pronto(_) => Self::PRONTO,
            RosMessage::Inekf(_) => Self::INEKF,
            RosMessage::Drift(_) => Self::DRIFT,
            RosMessage::Muse(_) => Self::MUSE,
            RosMessage::Unitree(_) => Self::UNITREE,
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
        let has_header = self.own.contains("std_msgs/Header header");
        let in_header = if has_header { &IN_HEADER[..] } else { &[] };
        let others = in_header.iter().chain(self.others);
        let others = others.map(|(name, text)| format!("{BETWEEN}{name}\n{text}"));
        self.own.to_owned() + &others.collect::<String>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flag, Flags, Phase};
    use recordings::events::EventKind;

    /// Value of a constant of a definition.
    fn constant(definition: &str, name: &str) -> Option<u8> {
        let line = definition
            .lines()
            .find_map(|line| line.strip_prefix(&format!("uint8 {name}=")));
        line.and_then(|value| value.parse().ok())
    }

    #[test]
    fn definition_contains_every_phase_and_flag() {
        for phase in Phase::ALL {
            let name = format!("STATE_{}", phase.name().to_uppercase());
            let number = samples::phase::code_of(phase);
            assert_eq!(constant(CONTACT, &name), Some(number), "{name}");
        }
        for flag in Flag::ALL {
            let name = format!("FLAG_{}", flag.name().to_uppercase());
            assert_eq!(
                constant(CONTACT, &name),
                Some(Flags::NONE.with(flag).bits()),
                "{name}"
            );
        }
    }

    #[test]
    fn definition_contains_every_kind_of_event() {
        for kind in EventKind::ALL {
            let name = kind.name().to_uppercase();
            let number = crate::estimates::kind_number(kind);
            assert_eq!(constant(EVENT, &name), Some(number), "{name}");
        }
    }
}
