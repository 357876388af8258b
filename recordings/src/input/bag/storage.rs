//! The messages of a bag, whatever it is stored in.

use super::super::error::InputError;
use super::super::format::Format;
use super::super::open::Part;
use super::{mcap, rosbag2};

/// A topic as a bag declares it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Channel {
    pub(super) topic: String,
    /// The type of its messages, such as `sensor_msgs/msg/Imu`.
    pub(super) message: String,
    /// How they are serialised: `cdr`.
    pub(super) encoding: String,
}

/// Whether the messages of a topic are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interest {
    Wanted,
    Unwanted,
}

/// What looks at a bag.
pub(super) trait Visitor {
    /// A topic is declared, before its messages. It may be declared more than once.
    fn channel(&mut self, channel: &Channel) -> Interest;

    /// A message of a topic that is wanted, with the time when it was written, ns.
    fn message(&mut self, channel: &Channel, log_ns: i64, payload: &[u8])
    -> Result<(), InputError>;
}

/// How a file ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum End {
    Complete,
    /// Before its end, for this reason.
    Early(String),
}

/// Shows all messages to a visitor, in the order in which they are stored. Says of each part that
/// ends early that it does.
pub(super) fn visit(
    parts: &mut [Part],
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Vec<String>, InputError> {
    let mut notices = Vec::new();
    let is_alone = parts.len() == 1;
    for part in parts {
        let name = if is_alone {
            file.to_owned()
        } else {
            part.path.display().to_string()
        };
        let end = match part.format {
            Format::Mcap => mcap::visit(part, &name, visitor)?,
            _ => rosbag2::visit(part, &name, visitor)?,
        };
        if let End::Early(why) = end {
            notices.push(format!("{name} ends early ({why}): what is there is read"));
        }
    }
    Ok(notices)
}

/// A time in µs from one in ns, rounded.
pub(super) fn micros(nanoseconds: i64) -> i64 {
    let rest = nanoseconds.rem_euclid(1000);
    nanoseconds.div_euclid(1000) + i64::from(rest >= 500)
}
