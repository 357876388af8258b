//! Recording of foot messages as MCAP, for `footfall record` and the monitor.

#[cfg(not(feature = "bags"))]
mod absent;
#[cfg(feature = "bags")]
mod written;

#[cfg(not(feature = "bags"))]
pub use absent::McapRecording;
#[cfg(feature = "bags")]
pub use written::{McapRecording, io_error};

/// Handling of an existing file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Keeps the file and records nothing.
    Kept,
    /// Replaces the file.
    Replaced,
}
