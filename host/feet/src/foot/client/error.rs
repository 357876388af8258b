//! Errors of requests.

use thiserror::Error;
use wire::{AbortCode, DataType, NodeId};

use crate::link::LinkError;

/// Error of a request.
#[derive(Debug, Error)]
pub enum RequestError {
    /// The foot has refused the request.
    #[error("{what} was refused: {} (0x{:08X}): {}", reason.name(), reason.code(), crate::decode::remedy::Trouble::Refusal(*reason).remedy())]
    Refused {
        /// Description of the request.
        what: String,
        /// Reason.
        reason: AbortCode,
    },
    /// The foot has refused the request with an unknown abort code.
    #[error("{what} was refused with the abort code 0x{code:08X}")]
    RefusedUnknown {
        /// Description of the request.
        what: String,
        /// Abort code.
        code: u32,
    },
    /// The foot has not responded.
    #[error("{foot} does not answer: {what}")]
    NoAnswer {
        /// Name of the foot.
        foot: String,
        /// Description of the request.
        what: String,
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
    #[error("{what} came as {length} bytes, which is no {}: another version of the foot's program?", data_type.name())]
    Type {
        /// Name and address of the object.
        what: String,
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
    #[error("{0} has started again meanwhile: settings that were not stored are gone")]
    StartedAgain(String),
    /// Another board has the new id of the foot.
    #[error("{foot} would become node {}, which is on the bus already", node.get())]
    Taken {
        /// Name of the foot.
        foot: String,
        /// New id.
        node: NodeId,
    },
    /// No foot was found.
    #[error("no foot is heard on this line")]
    NoFoot,
    /// No foot has the serial number.
    #[error(
        "no foot with the serial number 0x{wanted:08X} is heard on this line; those heard: {heard}. A foot without a node id needs one first"
    )]
    NoSerial {
        /// Serial number.
        wanted: u32,
        /// Serial numbers and nodes of the feet that are heard.
        heard: String,
    },
    /// Several feet were found, and no node is given.
    #[error("there are several feet, {0}: name one with --node")]
    Several(String),
    /// The line does not work.
    #[error(transparent)]
    Link(#[from] LinkError),
}

impl RequestError {
    /// Error of a request that was refused with this abort code.
    pub(super) fn refused(what: String, code: u32) -> Self {
        match AbortCode::from_code(code) {
            Some(reason) => Self::Refused { what, reason },
            None => Self::RefusedUnknown { what, code },
        }
    }

    /// Returns whether the request was refused for this reason.
    #[must_use]
    pub fn is_refusal(&self, of: AbortCode) -> bool {
        matches!(self, Self::Refused { reason, .. } if *reason == of)
    }
}
