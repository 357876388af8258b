//! Conversion of estimates from a recording to messages on the topics of a foot.
//!
//! | topic | message |
//! |---|---|
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` |
//! | `/footfall/FL/contact/probability` | `std_msgs/msg/Float64`: P alone; 0 if the estimate is invalid |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped`: zero, with the variance of the estimate |
//! | `/footfall/FL/event` | `footfall_msgs/msg/Event` |

use std::sync::Arc;

use estimator_core::{ContactEstimate, Decision, Timestamp};
use recordings::events::ContactEvent;
use recordings::samples::phase::code_of;
use wire::Faults;
use wire::pdo::Status;

use crate::ros::foot::zero_velocity;
use crate::ros::message::{RosContact, RosEvent, RosMessage};
use crate::ros::published::Published;
use crate::ros::topics::FootTopics;

/// Converter of the estimates of a foot.
#[derive(Debug)]
pub struct EstimateMessages {
    name: String,
    topics: FootTopics,
    sequence: u16,
}

impl EstimateMessages {
    /// Creates a converter for the foot `name`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), topics: FootTopics::of(name), sequence: 0 }
    }

    /// Topics of the messages.
    #[must_use]
    pub fn topics(&self) -> [&Arc<str>; 4] {
        let of = &self.topics;
        [&of.contact, &of.probability, &of.velocity, &of.event]
    }

    /// Returns the message of an event at `stamp` since 1970, which is written at `at`.
    #[must_use]
    pub fn event(&self, event: &ContactEvent, stamp: Timestamp, at: Timestamp) -> Published {
        let message = RosEvent {
            header: self.topics.header(stamp),
            foot: self.name.clone(),
            kind: event.kind as u8 + 1,
            duration: event.duration_us.map_or(f64::NAN, |us| us as f64 * 1.0e-6),
            p_peak: event.peak,
            distance: event.distance_m.unwrap_or(f64::NAN),
        };
        Published::new(&self.topics.event, at, RosMessage::Event(message))
    }

    /// Returns the messages of the next estimate, whose sample was acquired at `stamp` since 1970; they are written
    /// at `at`.
    pub fn messages(
        &mut self,
        estimate: &ContactEstimate,
        stamp: Timestamp,
        at: Timestamp,
    ) -> [Published; 3] {
        let (decision, phase, flags) = (estimate.decision, estimate.phase, estimate.flags);
        let status = Status::new(decision, phase, flags, Faults::NONE);
        let probabilities = &estimate.probabilities;
        let contact = RosContact {
            header: self.topics.header(stamp),
            foot: self.name.clone(),
            node: 0,
            p_stable: probabilities.stable,
            p_tangential: probabilities.tangential,
            p_vertical: probabilities.vertical,
            p_axes: probabilities.axes.to_array(),
            decision: decision == Decision::Stable,
            state: code_of(phase),
            valid: status.is_valid(),
            flags: flags.bits(),
            sequence: self.sequence,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let velocity = zero_velocity(&contact.header, estimate.velocity_sigma);
        let velocity = RosMessage::Velocity(Box::new(velocity));
        let probability = RosMessage::probability(&contact);
        [
            Published::new(&self.topics.velocity, at, velocity),
            Published::new(&self.topics.probability, at, probability),
            Published::new(&self.topics.contact, at, RosMessage::Contact(contact)),
        ]
    }
}
