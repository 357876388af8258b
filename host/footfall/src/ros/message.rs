//! Messages of ROS 2: their fields in the order of their definitions, their encoding (CDR, little-endian), and their
//! definitions as stored in recordings.
//!
//! The text of a definition contains the definition of the message, then the definitions of nested messages, each after a
//! line of `=` and its name. Definitions other than footfall's are interfaces of ROS 2, with the same names, types and order
//! of fields.

use estimator_core::{Vec3, VelocitySigma};
use samples::space::components;
use serde::Serialize;

pub use samples::ros::{Header, Imu, RosContact, Time, TwistWithCovarianceStamped};

/// A message that is published, encoded as its content.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum RosMessage {
    /// Contact of a foot.
    Contact(RosContact),
    /// Event of a recording.
    Event(RosEvent),
    /// IMU sample of a foot.
    Imu(Box<Imu>),
    /// Velocity of a foot.
    Velocity(Box<TwistWithCovarianceStamped>),
    /// `std_msgs/msg/Float64`: a probability or a load.
    Number(f64),
    /// `std_msgs/msg/String`: the validity of a sample.
    Text(String),
    /// `std_msgs/msg/Bool`: a decision, or the label of a sample.
    Bool(bool),
    /// Health and faults of a board.
    Diagnostics(DiagnosticArray),
    /// `champ_msgs/msg/ContactsStamped` of [champ](https://github.com/chvmp/champ).
    Champ(Stances<Vec<bool>>),
    /// `pronto_msgs/msg/QuadrupedStance` of [pronto](https://github.com/ori-drs/pronto): 1, or 0.
    Pronto(Stances<[f32; 4]>),
    /// `custom_sensor_msgs/msg/ContactArray` of [DRIFT](https://github.com/UMich-CURLY/drift), with numbers of the feet,
    /// right feet first.
    Drift(Stances<Vec<(i32, bool)>>),
    /// `state_estimator_msgs/msg/ContactDetection` of [MUSE](https://github.com/iit-DLSLab/muse).
    Muse(Stances<[bool; 4]>),
    /// State of a Unitree robot, with the forces of all feet.
    Unitree(Box<LowState>),
    /// `geometry_msgs/msg/WrenchStamped`: the force on a foot.
    Wrench(Box<WrenchStamped>),
    /// `biped_interfaces/msg/Phase`: the feet of a biped that stand.
    Phase(Stances<SupportPhase>),
}

impl RosMessage {
    /// Creates the message of a number.
    pub(crate) fn number(data: impl Into<f64>) -> Self {
        Self::Number(data.into())
    }

    /// Creates the message with only the probability of a contact: 0 if the contact is invalid.
    pub(crate) fn probability(contact: &RosContact) -> Self {
        Self::number(if contact.valid { contact.p_stable } else { 0.0 })
    }
}

#[cfg(feature = "cdr")]
impl RosMessage {
    /// Returns the encoded message with its header.
    ///
    /// # Panics
    /// Never: CDR represents all fields of these messages, and a test encodes each.
    #[must_use]
    pub fn cdr(&self) -> Vec<u8> {
        // Encapsulation header: CDR, little-endian, no options.
        let mut bytes = vec![0, 1, 0, 0];
        let encoded = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(self);
        bytes.extend(encoded.expect("CDR represents all fields"));
        bytes
    }
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

/// A message of other programs about all feet.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stances<T> {
    /// Header with the time of the newest sample.
    pub header: Header,
    /// Whether each foot stands: left front, right front, left hind, right hind. In
    /// [`RosMessage::Drift`](crate::ros::RosMessage) the right feet come first.
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

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WrenchStamped {
    /// Frame of the foot, and time of the newest sample.
    pub header: Header,
    /// Force, N.
    pub force: [f64; 3],
    /// Torque, N m: not measured, zero.
    torque: [f64; 3],
}

impl WrenchStamped {
    /// Creates a message with a force along z.
    #[must_use]
    pub fn along_z(header: Header, force: f64) -> Self {
        Self { header, force: [0.0, 0.0, force], torque: [0.0; 3] }
    }
}

/// Phase of a biped, by its number in `biped_interfaces/msg/Phase`, which has none for a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SupportPhase {
    /// The left foot stands alone.
    LeftStance = 0,
    /// The right foot stands alone.
    RightStance = 1,
    /// Both feet stand.
    DoubleStance = 2,
}

impl SupportPhase {
    /// Returns the phase in which the feet stand or not; `None` if neither does.
    #[must_use]
    pub const fn of(left: bool, right: bool) -> Option<Self> {
        match (left, right) {
            (true, false) => Some(Self::LeftStance),
            (false, true) => Some(Self::RightStance),
            (true, true) => Some(Self::DoubleStance),
            (false, false) => None,
        }
    }
}

impl Serialize for SupportPhase {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i32(*self as i32)
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
    /// Time of the diagnostics.
    pub header: Header,
    /// Status of each component.
    pub status: Vec<DiagnosticStatus>,
}

/// Covariance that marks a missing value.
pub(crate) const ABSENT: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Returns zero velocity with this standard deviation in each direction; the angular part carries no information.
pub(crate) fn zero_velocity(
    header: &Header,
    VelocitySigma(sigma): VelocitySigma,
) -> TwistWithCovarianceStamped {
    let mut velocity = TwistWithCovarianceStamped {
        header: header.clone(),
        ..TwistWithCovarianceStamped::default()
    };
    for (axis, row) in velocity.covariance.iter_mut().enumerate() {
        let of_axis = match axis {
            0..3 => sigma,
            _ => VelocitySigma::MOST.0,
        };
        row[axis] = f64::from(of_axis).powi(2);
    }
    velocity
}

/// Returns the components of a vector as f64.
pub(crate) fn vector(v: Vec3) -> [f64; 3] {
    components(v).map(f64::from)
}

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
            RosMessage::Drift(_) => Self::new(
                "custom_sensor_msgs/msg/ContactArray",
                "std_msgs/Header header\ncustom_sensor_msgs/Contact[] contacts\n",
            ),
            RosMessage::Muse(_) => Self::new(
                "state_estimator_msgs/msg/ContactDetection",
                "std_msgs/Header header\nbool stance_lf\nbool stance_rf\nbool stance_lh\nbool stance_rh\n",
            ),
            RosMessage::Unitree(_) => Self::new("unitree_go/msg/LowState", LOW_STATE),
            RosMessage::Wrench(_) => Self::new(
                "geometry_msgs/msg/WrenchStamped",
                "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
            ),
            RosMessage::Phase(_) => Self::new("biped_interfaces/msg/Phase", PHASE),
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

/// Definition of a contact, from the interface package.
pub const CONTACT: &str = include_str!("../../../../ros2/footfall_msgs/msg/Contact.msg");

/// Definition of an event, from the interface package.
pub const EVENT: &str = include_str!("../../../../ros2/footfall_msgs/msg/Event.msg");

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
    ("geometry_msgs/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"),
    ("diagnostic_msgs/DiagnosticStatus", STATUS),
    ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    ("custom_sensor_msgs/Contact", "int32 id\nbool indicator\n"),
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

const PHASE: &str = "int32 LEFT_STANCE=0
int32 RIGHT_SWING=0
int32 RIGHT_STANCE=1
int32 LEFT_SWING=1
int32 DOUBLE_STANCE=2
std_msgs/Header header
int32 phase
";

/// `unitree_go/msg/LowState` with the types in it.
const LOW_STATE: &str = include_str!("../../../bags/src/definition/low_state.msg");

/// Adds the nested messages of fields, each once and followed by the messages in it.
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
    use replay::events::EventKind;

    /// Value of a constant of a definition.
    fn constant(definition: &str, name: &str) -> Option<u8> {
        let line = definition.lines().find_map(|line| line.strip_prefix(&format!("uint8 {name}=")));
        line.and_then(|value| value.parse().ok())
    }

    #[test]
    fn definition_contains_every_phase_and_flag() {
        for phase in Phase::ALL {
            let name = format!("STATE_{}", phase.name().to_uppercase());
            let number = samples::phase_code(phase);
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

#[cfg(all(test, feature = "cdr"))]
mod cdr_tests {
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
        assert_eq!(RosMessage::Bool(true).cdr(), [0, 1, 0, 0, 1]);
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
            RosMessage::Drift(Stances::default()),
            RosMessage::Muse(Stances::default()),
            RosMessage::Unitree(Box::default()),
            RosMessage::Wrench(Box::default()),
            RosMessage::Phase(Stances {
                header: Header::default(),
                stances: SupportPhase::DoubleStance,
            }),
        ] {
            assert!(message.cdr().len() > 8, "{message:?}");
        }
    }
}
