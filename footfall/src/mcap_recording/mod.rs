//! Messages of feet, recorded as MCAP: by `footfall record`, and by the monitor.

#[cfg(not(feature = "bags"))]
mod absent;
#[cfg(feature = "bags")]
mod written;

#[cfg(not(feature = "bags"))]
pub use absent::McapRecording;
#[cfg(feature = "bags")]
pub use written::{McapRecording, io_error};

/// What becomes of a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// It stays, and nothing is recorded.
    Kept,
    /// It is replaced.
    Replaced,
}
