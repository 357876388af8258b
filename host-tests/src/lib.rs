//! Code shared by the integration tests of footfall: the oracle and access to the recordings.
//!
//! The tests themselves are in `tests/`, one file per subject.

pub mod changed;
pub mod committed;
pub mod constants;
pub mod datasets;
pub mod imports;
pub mod oracle;
pub mod qemu;
pub mod requirements;
pub mod slips;
