//! What feet say as messages of ROS 2, without ROS.
//!
//! | what | module |
//! |---|---|
//! | the messages, and their bytes (CDR) | [`message`] |
//! | their definitions, as a recording carries them | [`definition`] |
//! | what a foot says becomes messages on topics | [`bridge`] |
//! | messages in a file | [`mcap_file`] |

pub mod bridge;
pub mod definition;
pub mod mcap_file;
pub mod message;

pub use bridge::{Bridge, Published};
pub use mcap_file::McapFile;
