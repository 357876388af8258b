//! Recording of foot messages as MCAP, for `footfall record`.

#[cfg(not(feature = "bags"))]
mod absent;
#[cfg(feature = "bags")]
mod written;

#[cfg(not(feature = "bags"))]
pub use absent::McapRecording;
#[cfg(feature = "bags")]
pub use written::{McapRecording, io_error};
