//! Messages of ROS 2 from feet, without an installation of ROS.
//!
//! | content | module |
//! |---|---|
//! | messages, their encoding (CDR) and their definitions | [`message`] |
//! | topics of a foot, and a message on a topic | [`topics`] |
//! | streaming feet as messages on topics | [`bridge`] |
//! | recorded samples and estimates as messages on topics | [`recording`] |
//! | contacts of all feet in one message of other programs | [`compat`] |
//! | recording of messages: MCAP | `mcap_file`, with the feature `bags` |
//! | joining a domain of DDS | `domain`, with the feature `ros2` |
//! | node that publishes the messages | `node`, the same |
//! | topics of IMUs as a line of feet; definitions of an installation of ROS | `subscriber`, `definitions`, the same |
//! | the states of a Unitree robot with other forces | `low_state`, the same |
//! | routes to subscribers on this machine | `routes`, the same |

pub mod bridge;
pub mod compat;
#[cfg(feature = "ros2")]
mod definitions;
#[cfg(feature = "ros2")]
pub mod domain;
#[cfg(feature = "ros2")]
mod low_state;
#[cfg(feature = "bags")]
pub mod mcap_file;
pub mod message;
#[cfg(feature = "ros2")]
pub mod node;
pub mod recording;
#[cfg(feature = "ros2")]
mod routes;
#[cfg(feature = "ros2")]
pub mod subscriber;
pub mod topics;

pub use bridge::Bridge;
pub use compat::{AllFeet, Compat};
#[cfg(feature = "bags")]
pub use mcap_file::McapFile;
pub use message::RosMessage;
pub use recording::{EstimateMessages, SampleMessages};
pub use topics::{FootTopics, Published};
