//! What feet say as messages of ROS 2, without ROS.
//!
//! | what | module |
//! |---|---|
//! | the messages, and their bytes (CDR) | [`message`] |
//! | their definitions, as a recording carries them | [`definition`] |
//! | the topics of a foot | [`topics`] |
//! | what a foot says becomes messages on topics | [`bridge`] |
//! | samples that were recorded become messages on topics | [`samples`] |
//! | contacts of all feet become one message of champ or pronto | [`compat`] |
//! | what is known of a foot, and its messages | `foot` |
//! | for how long feet were listened to, which says which are silent | `listening` |
//! | messages in a file: MCAP, rosbag2 | `mcap_file`, `rosbag2_file`, with the feature `bags` |

pub mod bridge;
pub mod compat;
pub mod definition;
mod foot;
mod listening;
#[cfg(feature = "bags")]
pub mod mcap_file;
pub mod message;
#[cfg(feature = "bags")]
pub mod rosbag2_file;
pub mod samples;
pub mod topics;

pub use bridge::{Bridge, Published};
pub use compat::{AllFeet, Compat};
#[cfg(feature = "bags")]
pub use mcap_file::McapFile;
pub use message::Message;
#[cfg(feature = "bags")]
pub use rosbag2_file::Rosbag2File;
pub use samples::Samples;
pub use topics::Topics;
