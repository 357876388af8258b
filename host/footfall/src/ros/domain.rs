//! Joining a domain of DDS, to publish or to subscribe, and the errors of nodes and topics in it.

use std::fmt::Display;
use std::io;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};

use rustdds::{DomainParticipant, DomainParticipantBuilder};
use thiserror::Error;

/// Joins a domain over the interfaces with these addresses, or over all if there is none.
///
/// # Errors
/// No interface has one of the addresses, or the ports cannot be used.
pub(super) fn join(domain_id: u16, networks: &[IpAddr]) -> Result<DomainParticipant, NodeError> {
    if let Some((address, source)) = first_absent(networks) {
        return Err(NodeError::Network { address, source });
    }
    let mut participant = DomainParticipantBuilder::new(domain_id);
    if !networks.is_empty() {
        participant = participant.with_only_networks(networks.iter().copied());
    }
    participant.build().map_err(NodeError::domain(domain_id))
}

/// Returns the first address that no interface has, with the reason. `rustdds` does not use IPv6 addresses.
fn first_absent(networks: &[IpAddr]) -> Option<(IpAddr, io::Error)> {
    networks.iter().find_map(|&address| {
        let bound = match address {
            IpAddr::V4(Ipv4Addr::UNSPECIFIED) => Err(io::ErrorKind::AddrNotAvailable.into()),
            IpAddr::V4(_) => UdpSocket::bind((address, 0)).map(drop),
            IpAddr::V6(_) => Err(io::ErrorKind::Unsupported.into()),
        };
        bound.err().map(|source| (address, source))
    })
}

/// Reason a node or a topic cannot be created.
#[derive(Debug, Error)]
pub enum NodeError {
    /// A name is not valid in ROS.
    #[error(
        "{name:?} is not a valid name of a {what} in ROS: use letters, digits and _, begin with a letter, and do not use __"
    )]
    Name {
        /// Kind of the name.
        what: &'static str,
        /// Name as given.
        name: String,
    },
    /// No interface of this machine has the address. Nothing would be sent, and no error reported.
    #[error("network {address}: {source}; give the IPv4 address of an interface of this machine")]
    Network {
        /// The address.
        address: IpAddr,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Nothing can be sent in the domain.
    #[error("domain {domain_id}: {reason}")]
    Domain {
        /// The domain.
        domain_id: u16,
        /// Error of `rustdds`.
        reason: String,
    },
    /// The node or a publisher cannot be created.
    #[error("{name}: {reason}")]
    Create {
        /// The node or the topic.
        name: String,
        /// Error of `rustdds` or `ros2-client`.
        reason: String,
    },
}

impl NodeError {
    /// Returns the conversion of an error about a domain.
    pub(super) fn domain<E: Display>(domain_id: u16) -> impl Fn(E) -> Self {
        move |error| Self::Domain { domain_id, reason: error.to_string() }
    }

    /// Returns the conversion of an error about a node or a topic.
    pub(super) fn create(name: impl Into<String>) -> impl Fn(&dyn Display) -> Self {
        let name = name.into();
        move |error| Self::Create { name: name.clone(), reason: error.to_string() }
    }
}
