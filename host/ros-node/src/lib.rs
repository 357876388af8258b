//! A ROS 2 node that publishes the messages of feet. It uses `rustdds` and `ros2-client`; no installation of
//! ROS is required or linked.
//!
//! | content | module |
//! |---|---|
//! | domain, networks, names, quality of service | [`options`] |
//! | the node: publishers, counts of messages, shutdown | [`node`] |
//!
//! Messages and topics are those of [`ros`].

pub mod node;
pub mod options;

pub use node::{FootNode, NodeError, Sent};
pub use options::{Options, Reliability};
