//! Code shared by the integration tests of footfall: the oracle and access to the recordings.
//!
//! The tests themselves are in `tests/`, one file per subject.

pub mod changed;
pub mod committed;
pub mod datasets;
pub mod drawing;
pub mod labelled;
pub mod one_robot;
pub mod oracle;
pub mod qemu;
pub mod requirements;
pub mod resample;
pub mod sets;
pub mod slips;
