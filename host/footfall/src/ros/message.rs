//! Messages of ROS 2, with fields in the order of their definitions, and their encoding: CDR, little-endian.

use serde::Serialize;

pub use recordings::ros::{Header, Imu, RosContact, Time, TwistWithCovarianceStamped};

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

/// A message of other programs about all feet.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stances<T> {
    /// When the newest of its samples was acquired.
    pub header: Header,
    /// Whether each foot stands: left front, right front, left hind, right hind; of [`RosMessage::Drift`](crate::ros::RosMessage),
    /// the right feet come first.
    pub stances: T,
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
        Self { foot_force, foot_force_est: foot_force, ..Self::default() }
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
    /// `std_msgs/msg/Float64`: a probability or a load.
    Number(f64),
    /// `std_msgs/msg/String`: how far a sample is to be trusted.
    Text(String),
    /// `std_msgs/msg/Bool`: a decision, or the truth about a sample.
    Bool(bool),
    /// How the board is.
    Diagnostics(DiagnosticArray),
    /// `champ_msgs/msg/ContactsStamped` of [champ](https://github.com/chvmp/champ).
    Champ(Stances<Vec<bool>>),
    /// `pronto_msgs/msg/QuadrupedStance` of [pronto](https://github.com/ori-drs/pronto): 1, or 0.
    Pronto(Stances<[f32; 4]>),
    /// `inekf_msgs/msg/ContactArray` of [InEKF](https://github.com/RossHartley/invariant-ekf-ros), with numbers of the
    /// feet.
    Inekf(Stances<Vec<(i32, bool)>>),
    /// `custom_sensor_msgs/msg/ContactArray` of [DRIFT](https://github.com/UMich-CURLY/drift), with numbers of the feet,
    /// right feet first.
    Drift(Stances<Vec<(i32, bool)>>),
    /// `state_estimator_msgs/msg/ContactDetection` of [MUSE](https://github.com/iit-DLSLab/muse).
    Muse(Stances<[bool; 4]>),
    /// All feet of a robot, as Unitree has them.
    Unitree(Box<LowState>),
}

impl RosMessage {
    /// Creates the message of a number.
    pub(crate) fn number(data: impl Into<f64>) -> Self {
        Self::Number(data.into())
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
        let number = RosMessage::Number(0.5).cdr();
        assert_eq!(number, [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0xE0, 0x3F]);
        let contact = RosContact {
            header: Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: "ab".to_owned() },
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
            RosMessage::Number(0.0),
            RosMessage::Text(String::new()),
            RosMessage::Diagnostics(diagnostics),
            RosMessage::Champ(Stances::default()),
            RosMessage::Pronto(Stances::default()),
            RosMessage::Inekf(Stances::default()),
            RosMessage::Drift(Stances::default()),
            RosMessage::Muse(Stances::default()),
            RosMessage::Unitree(Box::default()),
        ] {
            assert!(message.cdr().len() > 8, "{message:?}");
        }
    }
}
