//! A node of ROS 2 that publishes what feet say. DDS is `rustdds`, the node `ros2-client`: no ROS is
//! installed or linked.
//!
//! | what | module |
//! |---|---|
//! | domain, networks, names, quality of service | [`options`] |
//! | the node: topics as they appear, what was sent, how it ends | [`node`] |
//!
//! Messages and topics are those of [`ros`].

pub mod node;
pub mod options;

pub use node::{FootNode, NodeError, Sent};
pub use options::{Options, Reliability};
