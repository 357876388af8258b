//! Messages of a bag, independent of its storage.

use std::rc::Rc;

use super::super::error::InputError;

/// A topic as declared in a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Channel {
    /// Name of the topic.
    pub(super) topic: String,
    /// Type of its messages, such as `sensor_msgs/msg/Imu`.
    pub(super) message: String,
    /// Serialisation of its messages: `cdr`.
    pub(super) encoding: String,
    /// Definition of the type, if the bag has one.
    pub(super) schema: Option<Rc<Schema>>,
}

/// Definition of a type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Schema {
    /// Its language, such as `ros2msg`.
    pub(super) encoding: String,
    /// Its text.
    pub(super) text: Vec<u8>,
}

/// Receives the topics and messages of a bag.
pub(super) trait Visitor {
    /// Declares a topic before its messages; returns whether they are needed. A topic may be declared more than once.
    fn channel(&mut self, channel: &Channel) -> bool;

    /// Passes a message of a topic that is needed, with the time at which it was written, ns.
    fn message(&mut self, channel: &Channel, log_ns: i64, payload: &[u8])
    -> Result<(), InputError>;
}

/// Converts a time from ns to µs, rounded.
pub(super) fn micros(nanoseconds: i64) -> i64 {
    let rest = nanoseconds.rem_euclid(1000);
    nanoseconds.div_euclid(1000) + i64::from(rest >= 500)
}
