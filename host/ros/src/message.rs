//! Messages of ROS 2, with fields in the order of their definitions, and their encoding: CDR, little-endian.

use estimator_core::Timestamp;
use serde::Serialize;

/// `builtin_interfaces/msg/Time`: since 1970.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Time {
    /// s.
    pub sec: i32,
    /// ns of a second.
    pub nanosec: u32,
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
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// In which frame.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Quaternion`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "its components")]
pub struct RosQuaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

/// `geometry_msgs/msg/Vector3`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "its components")]
pub struct Vector3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// `sensor_msgs/msg/Imu`. A covariance whose first number is −1 says that there is no such value; one
/// of zeros, that it is not known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Imu {
    /// When the sample was acquired.
    pub header: Header,
    /// Foot → world.
    pub orientation: RosQuaternion,
    /// Of the orientation.
    pub orientation_covariance: [f64; 9],
    /// rad/s.
    pub angular_velocity: Vector3,
    /// Of the angular velocity.
    pub angular_velocity_covariance: [f64; 9],
    /// m/s², gravity included.
    pub linear_acceleration: Vector3,
    /// Of the acceleration.
    pub linear_acceleration_covariance: [f64; 9],
}

/// `geometry_msgs/msg/Twist`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Twist {
    /// m/s.
    pub linear: Vector3,
    /// rad/s.
    pub angular: Vector3,
}

/// `geometry_msgs/msg/TwistWithCovariance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TwistWithCovariance {
    /// The velocity.
    pub twist: Twist,
    /// Of x, y, z and the rates about them, row by row, (m/s)² and (rad/s)².
    pub covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/TwistWithCovarianceStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TwistWithCovarianceStamped {
    /// When the sample was acquired.
    pub header: Header,
    /// The velocity and its covariance.
    pub twist: TwistWithCovariance,
}

/// `footfall_msgs/msg/Contact`; `ros2/footfall_msgs/msg/Contact.msg` says what its fields mean.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition has them")]
pub struct RosContact {
    pub header: Header,
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

/// `footfall_msgs/msg/Event`; `ros2/footfall_msgs/msg/Event.msg` describes its fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the definition has them")]
pub struct RosEvent {
    pub header: Header,
    pub foot: String,
    pub kind: u8,
    pub duration: f64,
    pub p_peak: f32,
    pub distance: f64,
}

/// `std_msgs/msg/Float64`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Float64 {
    /// The number.
    pub data: f64,
}

/// `std_msgs/msg/String`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RosString {
    /// The text.
    pub data: String,
}

/// `std_msgs/msg/Bool`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bool {
    /// The answer.
    pub data: bool,
}

/// `champ_msgs/msg/ContactsStamped` of [champ](https://github.com/chvmp/champ).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactsStamped {
    /// When the newest of its samples was acquired.
    pub header: Header,
    /// Whether left front, right front, left hind and right hind stand.
    pub contacts: Vec<bool>,
}

/// `pronto_msgs/msg/QuadrupedStance` of [pronto](https://github.com/ori-drs/pronto).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct QuadrupedStance {
    /// When the newest of its samples was acquired.
    pub header: Header,
    /// Whether the left front foot stands: 1, or 0.
    pub lf: f32,
    /// Of the right front foot.
    pub rf: f32,
    /// Of the left hind foot.
    pub lh: f32,
    /// Of the right hind foot.
    pub rh: f32,
}

/// `Contact` of `inekf_msgs` and of `custom_sensor_msgs`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NumberedContact {
    /// Number of the foot.
    pub id: i32,
    /// Whether it stands.
    pub indicator: bool,
}

/// `ContactArray` of `inekf_msgs`, of [InEKF](https://github.com/RossHartley/invariant-ekf-ros), and of
/// `custom_sensor_msgs`, of [DRIFT](https://github.com/UMich-CURLY/drift).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactArray {
    /// When the newest of its samples was acquired.
    pub header: Header,
    /// Of each foot.
    pub contacts: Vec<NumberedContact>,
}

/// `state_estimator_msgs/msg/ContactDetection` of [MUSE](https://github.com/iit-DLSLab/muse).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactDetection {
    /// When the newest of its samples was acquired.
    pub header: Header,
    /// Whether the left front, right front, left hind and right hind foot stand.
    pub stance: [bool; 4],
}

/// `unitree_go/msg/LowState` with its forces; all other fields are zero. They have 1080 bytes before the forces and 80
/// after them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LowState {
    before: [[[u8; 10]; 9]; 12],
    /// `foot_force`, of the right front, left front, right hind and left hind foot.
    pub foot_force: [i16; 4],
    /// `foot_force_est`, the same.
    pub foot_force_est: [i16; 4],
    after: [[u8; 20]; 4],
}

impl LowState {
    /// Creates a message with these forces.
    #[must_use]
    pub fn with_forces(foot_force: [i16; 4]) -> Self {
        Self {
            foot_force,
            foot_force_est: foot_force,
            ..Self::default()
        }
    }
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "its name says it")]
pub struct KeyValue {
    pub key: String,
    pub value: String,
}

/// Severity of a diagnostic status.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// No problem.
    #[default]
    Ok,
    /// Works with a problem.
    Warn,
    /// Does not work.
    Error,
    /// No data is received.
    Stale,
}

impl Serialize for Level {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u8(*self as u8)
    }
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DiagnosticStatus {
    /// Severity.
    pub level: Level,
    /// Name of the component.
    pub name: String,
    /// Description of the state.
    pub message: String,
    /// Identity of the hardware.
    pub hardware_id: String,
    /// Further values.
    pub values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DiagnosticArray {
    /// When.
    pub header: Header,
    /// Of each part.
    pub status: Vec<DiagnosticStatus>,
}

/// A message that is published. Its bytes are those of what it holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum RosMessage {
    /// The contact.
    Contact(RosContact),
    /// Event of a recording.
    Event(RosEvent),
    /// The IMU.
    Imu(Box<Imu>),
    /// A velocity.
    Velocity(Box<TwistWithCovarianceStamped>),
    /// A number: a probability or a load.
    Number(Float64),
    /// How far a sample is to be trusted.
    Text(RosString),
    /// A decision, or the truth about a sample.
    Bool(Bool),
    /// How the board is.
    Diagnostics(DiagnosticArray),
    /// All feet of a robot, as champ has them.
    Champ(ContactsStamped),
    /// All feet of a robot, as pronto has them.
    Pronto(QuadrupedStance),
    /// All feet of a robot, as `InEKF` has them.
    Inekf(ContactArray),
    /// All feet of a robot, as DRIFT has them.
    Drift(ContactArray),
    /// All feet of a robot, as MUSE has them.
    Muse(ContactDetection),
    /// All feet of a robot, as Unitree has them.
    Unitree(Box<LowState>),
}

impl RosMessage {
    /// Creates the message of a number.
    pub(crate) fn number(data: impl Into<f64>) -> Self {
        Self::Number(Float64 { data: data.into() })
    }

    /// Creates the message of the probability of a contact alone: 0 if it is invalid.
    pub(crate) fn probability(contact: &RosContact) -> Self {
        Self::number(if contact.valid { contact.p_stable } else { 0.0 })
    }
}

#[cfg(feature = "cdr")]
impl RosMessage {
    /// Returns the encoded message with its header.
    #[must_use]
    pub fn cdr(&self) -> Vec<u8> {
        // Encapsulation header: CDR, little-endian, no options.
        let mut bytes = vec![0, 1, 0, 0];
        // CDR can represent all fields of these messages; a test encodes each.
        let encoded = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(self);
        bytes.extend(encoded.unwrap_or_default());
        bytes
    }
}

#[cfg(all(test, feature = "cdr"))]
mod tests {
    use super::*;

    #[test]
    fn fields_are_aligned_as_cdr_requires() {
        let number = RosMessage::Number(Float64 { data: 0.5 }).cdr();
        assert_eq!(number, [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0xE0, 0x3F]);
        let contact = RosContact {
            header: Header {
                stamp: Time { sec: 1, nanosec: 2 },
                frame_id: "ab".to_owned(),
            },
            foot: "F".to_owned(),
            node: 7,
            p_stable: 1.0,
            decision: true,
            sequence: 0x1234,
            ..RosContact::default()
        };
        let bytes = RosMessage::Contact(contact).cdr();
        // stamp 8, "ab" 4 + 3 + 1, "F" 4 + 2, node 1, + 1, nine floats, four bytes, 2.
        let body = &bytes[4..];
        assert_eq!(body.len(), 8 + 8 + 6 + 1 + 1 + 36 + 4 + 2);
        assert_eq!(body[8..15], [3, 0, 0, 0, b'a', b'b', 0]);
        assert_eq!(body[16..23], [2, 0, 0, 0, b'F', 0, 7]);
        assert_eq!(body[24..28], 1.0_f32.to_le_bytes());
        assert_eq!(body[60..], [1, 0, 0, 0, 0x34, 0x12]);
    }

    #[test]
    fn every_message_is_encoded() {
        let diagnostics = DiagnosticArray {
            status: vec![DiagnosticStatus {
                level: Level::Error,
                values: vec![KeyValue::default()],
                ..DiagnosticStatus::default()
            }],
            ..DiagnosticArray::default()
        };
        for message in [
            RosMessage::Contact(RosContact::default()),
            RosMessage::Event(RosEvent::default()),
            RosMessage::Imu(Box::default()),
            RosMessage::Velocity(Box::default()),
            RosMessage::Number(Float64::default()),
            RosMessage::Text(RosString::default()),
            RosMessage::Diagnostics(diagnostics),
            RosMessage::Champ(ContactsStamped::default()),
            RosMessage::Pronto(QuadrupedStance::default()),
            RosMessage::Inekf(ContactArray::default()),
            RosMessage::Drift(ContactArray::default()),
            RosMessage::Muse(ContactDetection::default()),
            RosMessage::Unitree(Box::default()),
        ] {
            assert!(message.cdr().len() > 8, "{message:?}");
        }
    }
}
