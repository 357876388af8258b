//! Requests to a foot as their errors name them, and these errors.

use std::fmt;
use std::time::Duration;

use thiserror::Error;
use wire::{AbortCode, Address, DataType, NodeId};

use super::name::Named;
use crate::link::LinkError;
use crate::remedy::{FootHint, Trouble};

/// Maximum number of attempts per request, because frames may be lost.
pub(super) const TRIES: u32 = 3;

/// Error of a request.
#[derive(Debug, Error)]
pub enum RequestError {
    /// The foot has refused the request.
    #[error("{request} was refused: {} (0x{:08X}): {}", reason.name(), reason.code(), Trouble::Refusal(*reason).remedy())]
    Refused {
        /// The request.
        request: FootRequest,
        /// Reason.
        reason: AbortCode,
    },
    /// The foot has refused the request with an unknown abort code.
    #[error("{request} was refused with the abort code 0x{code:08X}")]
    RefusedUnknown {
        /// The request.
        request: FootRequest,
        /// Abort code.
        code: u32,
    },
    /// The foot has not responded.
    #[error("{foot} does not answer: {request}{}", request.attempts())]
    NoAnswer {
        /// Name of the foot.
        foot: String,
        /// The request.
        request: FootRequest,
    },
    /// Several boards respond as one node.
    #[error(
        "{foot} answers {count} times: boards with the same id are on this bus; connect them one at a time"
    )]
    SameId {
        /// Name of the foot.
        foot: String,
        /// Number of responses.
        count: usize,
    },
    /// The response does not have the object's type.
    #[error("{} has {length} bytes, which is not a valid {}: another version of the foot's program?", named(*address), data_type.name())]
    Type {
        /// The object.
        address: Address,
        /// Length of the response, bytes.
        length: usize,
        /// Expected type.
        data_type: DataType,
    },
    /// The value is unknown to this version.
    #[error("{what} is {code}, which this version does not know")]
    Unknown {
        /// Name of the value.
        what: &'static str,
        /// Code of the value.
        code: u32,
    },
    /// The foot has restarted while it was being configured.
    #[error("{0} has restarted meanwhile: settings that were not stored are lost")]
    StartedAgain(String),
    /// Another board has the new id of the foot.
    #[error("{foot} would become node {}, which is already on the bus", node.get())]
    Taken {
        /// Name of the foot.
        foot: String,
        /// New id.
        node: NodeId,
    },
    /// No foot was found.
    #[error("no foot was found on this line")]
    NoFoot,
    /// No foot has the serial number.
    #[error(
        "no foot with the serial number 0x{wanted:08X} was found on this line; found: {}. A foot without a node id needs one first",
        serial_numbers(found)
    )]
    NoSerial {
        /// Serial number.
        wanted: u32,
        /// Serial numbers and nodes of the feet that respond; a foot on a serial line has no node.
        found: Vec<(u32, Option<NodeId>)>,
    },
    /// Several feet were found, with these ids, and no node is given.
    #[error("there are several feet, {}", list(.0))]
    SeveralFeet(Vec<u8>),
    /// The line does not work.
    #[error(transparent)]
    Link(#[from] LinkError),
}

fn list(ids: &[u8]) -> String {
    ids.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn serial_numbers(found: &[(u32, Option<NodeId>)]) -> String {
    let found = found.iter().map(|(serial, node)| match node {
        Some(node) => format!("0x{serial:08X} (node {})", node.get()),
        None => format!("0x{serial:08X}"),
    });
    match &found.collect::<Vec<String>>()[..] {
        [] => "none".to_owned(),
        found => found.join(", "),
    }
}

impl RequestError {
    /// Creates the error of a request that was refused with this abort code.
    pub(super) fn refused(request: FootRequest, code: u32) -> Self {
        match AbortCode::from_code(code) {
            Some(reason) => Self::Refused { request, reason },
            None => Self::RefusedUnknown { request, code },
        }
    }

    /// Returns whether the request was refused for this reason.
    #[must_use]
    pub fn is_refusal(&self, of: AbortCode) -> bool {
        matches!(self, Self::Refused { reason, .. } if *reason == of)
    }

    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::SeveralFeet(_) => Some(FootHint::NameOneFoot),
            Self::Link(error) => error.hint(),
            _ => None,
        }
    }
}

/// Request to a foot, as its errors name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootRequest {
    /// An object is read.
    Read(Address),
    /// An object is written.
    Write(Address),
    /// A number of bytes is sent to an object.
    Download {
        /// The object.
        address: Address,
        /// Number of bytes.
        bytes: usize,
    },
    /// The foot is commanded to stream.
    Start,
    /// The foot reports its state, in a heartbeat or a health message.
    State,
    /// The foot is commanded to reset.
    Reset {
        /// Number of commands.
        times: u32,
    },
    /// The foot responds for the first time after a reset.
    FirstAnswer {
        /// Time since the reset.
        since: Duration,
    },
    /// The foot responds as its bootloader.
    Bootloader,
}

impl fmt::Display for FootRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(address) => write!(f, "reading {}", named(*address)),
            Self::Write(address) => write!(f, "writing {}", named(*address)),
            Self::Download { address, bytes } => {
                write!(f, "sending {bytes} bytes to {}", named(*address))
            }
            Self::Start => f.write_str("the command to start"),
            Self::State => f.write_str("its state, in a heartbeat or health message,"),
            Self::Reset { times } => {
                write!(f, "it was commanded to reset {times} times, and has not")
            }
            Self::FirstAnswer { since } => write!(f, "it was reset {} s ago", since.as_secs()),
            Self::Bootloader => f.write_str("as its bootloader"),
        }
    }
}

impl FootRequest {
    /// Returns the number of attempts in words, if the request is repeated until it has a response.
    fn attempts(self) -> String {
        match self {
            Self::Read(_) | Self::Write(_) => format!(", asked {TRIES} times"),
            _ => String::new(),
        }
    }
}

/// Formats an object as its name and address.
fn named(address: Address) -> String {
    let Address { index, subindex } = address;
    let name = Named::at(address).map(|named| format!("{} ", named.name()));
    format!("{}(0x{index:04X}:{subindex})", name.unwrap_or_default())
}
