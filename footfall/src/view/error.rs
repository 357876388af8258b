//! Why nothing can be served.

use std::io;
use std::net::{IpAddr, SocketAddr};

use foxglove::FoxgloveError;
use thiserror::Error;

/// Why nothing can be served.
#[derive(Debug, Error)]
pub enum ViewError {
    /// A host has no address.
    #[error("--host {host}: {source}")]
    Host {
        /// As it was written.
        host: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// There can be no server at this address.
    #[error("nothing can be served at {address}: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// What the operating system says.
        source: Box<FoxgloveError>,
    },
    /// Another program has the port.
    #[error("port {port} of {host} is in use; --port 0 takes any port that is free")]
    PortInUse {
        /// The host.
        host: IpAddr,
        /// The port.
        port: u16,
    },
    /// A topic cannot be announced.
    #[error("{topic} cannot be announced: {source}")]
    Topic {
        /// The topic.
        topic: String,
        /// What the server says.
        source: Box<FoxgloveError>,
    },
}

impl ViewError {
    /// Why a server cannot be at this address.
    pub(super) fn of_bind(address: SocketAddr, error: FoxgloveError) -> Self {
        match error {
            FoxgloveError::Bind(source) if source.kind() == io::ErrorKind::AddrInUse => {
                Self::PortInUse {
                    host: address.ip(),
                    port: address.port(),
                }
            }
            error => Self::Address {
                address,
                source: Box::new(error),
            },
        }
    }
}
