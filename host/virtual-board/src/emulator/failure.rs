//! Failures that end a run: the firmware misused the part, or used something that is not modelled.

use core::fmt;

/// A misuse of the part, and its address.
#[derive(Clone, Debug, PartialEq, Eq)]
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
        Self {
            pc,
            address: address.into(),
            what: what.into(),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "at {:#010x}", self.pc)?;
        if let Some(address) = self.address {
            write!(f, ", address {address:#010x}")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl core::error::Error for Failure {}
