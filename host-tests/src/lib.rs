//! What the tests of footfall from outside share: the oracle and the way to the recordings.
//!
//! The tests themselves are in `tests/`, one file a subject.

pub mod changed;
pub mod committed;
pub mod datasets;
pub mod oracle;
pub mod qemu;
pub mod requirements;
pub mod slips;
