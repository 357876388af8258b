//! Messages of ROS 2 from feet, without an installation of ROS.
//!
//! | content | module |
//! |---|---|
//! | messages, and their encoding (CDR) | [`message`] |
//! | message definitions, as stored in recordings | [`definition`] |
//! | topics of a foot | [`topics`] |
//! | message on a topic | [`published`] |
//! | conversion of a foot's data to messages on topics | [`bridge`] |
//! | conversion of recorded samples to messages on topics | [`samples`] |
//! | conversion of estimates from a recording to messages on topics | [`estimates`] |
//! | contacts of all feet in one message of other programs | [`compat`] |
//! | messages of a foot | `foot` |
//! | recording of messages: MCAP | `mcap_file`, with the feature `bags` |
//! | node that publishes the messages | `node`, with the feature `node` |

pub mod bridge;
pub mod compat;
pub mod definition;
pub mod estimates;
mod foot;
#[cfg(feature = "bags")]
mod mcap_file;
pub mod message;
#[cfg(feature = "ros2")]
pub mod node;
pub mod published;
pub mod samples;
pub mod topics;

pub use bridge::Bridge;
pub use compat::{AllFeet, Compat};
pub use estimates::EstimateMessages;
#[cfg(feature = "bags")]
pub use mcap_file::McapFile;
pub use message::RosMessage;
pub use published::Published;
pub use samples::SampleMessages;
pub use topics::FootTopics;
