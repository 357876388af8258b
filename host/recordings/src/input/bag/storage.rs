//! Messages of a bag, independent of its storage.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::super::error::InputError;

/// A topic as declared in a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages, such as `sensor_msgs/msg/Imu`.
    pub message: String,
    /// Serialisation of its messages: `cdr`.
    pub encoding: String,
    /// Definition of the type, if the bag has one.
    pub schema: Option<Rc<Schema>>,
    /// Further properties, such as the quality of service.
    pub metadata: BTreeMap<String, String>,
}

/// Definition of a type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Its language, such as `ros2msg`.
    pub encoding: String,
    /// Its text.
    pub text: Vec<u8>,
}

/// When a message was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Time at which it was written, ns.
    pub log_ns: i64,
    /// Time at which it was sent, ns; that of writing where the storage keeps one time.
    pub publish_ns: i64,
    /// Number given by its sender, where the storage keeps it.
    pub sequence: Option<u32>,
}

/// Receives the topics and messages of a bag.
pub(super) trait Visitor {
    /// Declares a topic before its messages; returns whether they are needed. A topic may be declared more than once.
    fn channel(&mut self, channel: &Channel) -> bool;

    /// Passes a message of a topic that is needed.
    fn message(
        &mut self,
        channel: &Channel,
        written: Written,
        payload: &[u8],
    ) -> Result<(), InputError>;
}

/// Converts a time from ns to µs, rounded.
pub(super) fn micros(nanoseconds: i64) -> i64 {
    let rest = nanoseconds.rem_euclid(1000);
    nanoseconds.div_euclid(1000) + i64::from(rest >= 500)
}
