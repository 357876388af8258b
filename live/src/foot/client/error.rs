//! Why a request came to nothing.

use thiserror::Error;
use wire::{AbortCode, DataType, NodeId};

use crate::link::LinkError;

/// Why a request came to nothing.
#[derive(Debug, Error)]
pub enum RequestError {
    /// The foot has refused it.
    #[error("{what} was refused: {} (0x{:08X}): {}", reason.name(), reason.code(), decode::remedy::Trouble::Refusal(*reason).remedy())]
    Refused {
        /// What.
        what: String,
        /// Why.
        reason: AbortCode,
    },
    /// The foot has refused it for a reason that is not known here.
    #[error("{what} was refused with the abort code 0x{code:08X}")]
    RefusedUnknown {
        /// What.
        what: String,
        /// The code.
        code: u32,
    },
    /// Nothing has answered.
    #[error("{foot} does not answer: {what}")]
    NoAnswer {
        /// Who was asked.
        foot: String,
        /// What for.
        what: String,
    },
    /// Several boards answer as one node.
    #[error(
        "{foot} answers {count} times: boards with the same id are on this bus; connect them one at a time"
    )]
    SameId {
        /// Who was asked.
        foot: String,
        /// How many answers came.
        count: usize,
    },
    /// Something else than the object's type came.
    #[error("{what} came as {length} bytes, which is no {}: another version of the foot's program?", data_type.name())]
    Type {
        /// What.
        what: String,
        /// How long it was.
        length: usize,
        /// What it should be.
        data_type: DataType,
    },
    /// Something came that this version does not know.
    #[error("{what} is {code}, which this version does not know")]
    Unknown {
        /// What.
        what: &'static str,
        /// Its code.
        code: u32,
    },
    /// It has started again while it was set.
    #[error("{foot} has started again meanwhile: settings that were not stored are gone")]
    StartedAgain {
        /// Who was asked.
        foot: String,
    },
    /// Another board has the id that the foot would have.
    #[error("{foot} would become node {}, which is on the bus already", node.get())]
    Taken {
        /// Who was asked.
        foot: String,
        /// The id.
        node: NodeId,
    },
    /// No foot is heard.
    #[error("no foot is heard on this line")]
    NoFoot,
    /// Several are, and nothing says which is meant.
    #[error("there are several feet, {0}: name one with --node")]
    Several(String),
    /// The line does not work.
    #[error(transparent)]
    Link(#[from] LinkError),
}
