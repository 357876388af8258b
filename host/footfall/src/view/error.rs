//! Errors of the viewer server.

use std::io;
use std::net::{IpAddr, SocketAddr};

use foxglove::FoxgloveError;
use thiserror::Error;

/// Reason the server cannot serve.
#[derive(Debug, Error)]
pub enum ViewError {
    /// The host has no address.
    #[error("--host {host}: {source}")]
    Host {
        /// Host as given.
        host: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The server cannot use this address.
    #[error("nothing can be served at {address}: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// Error of the operating system.
        source: Box<FoxgloveError>,
    },
    /// The port is used by another program.
    #[error("port {port} of {host} is in use; --port 0 takes any port that is free")]
    PortInUse {
        /// The host.
        host: IpAddr,
        /// The port.
        port: u16,
    },
    /// The topic cannot be announced.
    #[error("{topic} cannot be announced: {source}")]
    Topic {
        /// The topic.
        topic: String,
        /// Error of the server.
        source: Box<FoxgloveError>,
    },
}
