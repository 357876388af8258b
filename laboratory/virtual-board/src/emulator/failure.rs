//! Failures that end a run: the firmware misused the part, or used something that is not modelled.

use thiserror::Error;

/// A misuse of the part, and its address.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("at {pc:#010x}{}: {what}", address.map_or_else(String::new, |at| format!(", address {at:#010x}")))]
pub struct Failure {
    /// Address of the instruction.
    pub pc: u32,
    /// The address accessed, if any.
    pub address: Option<u32>,
    /// Description of the misuse.
    pub what: String,
}

impl Failure {
    pub(crate) fn new(pc: u32, address: impl Into<Option<u32>>, what: impl Into<String>) -> Self {
        Self { pc, address: address.into(), what: what.into() }
    }
}
