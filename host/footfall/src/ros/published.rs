//! Message on a topic.

use std::sync::Arc;

use estimator_core::Timestamp;

use crate::ros::message::RosMessage;

/// A message with its topic and time of reception.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// The topic.
    pub topic: Arc<str>,
    /// Time of reception of its data.
    pub at: Timestamp,
    /// The message.
    pub message: RosMessage,
}

impl Published {
    pub(crate) fn new(topic: &Arc<str>, at: Timestamp, message: RosMessage) -> Self {
        let topic = Arc::clone(topic);
        Self { topic, at, message }
    }
}
