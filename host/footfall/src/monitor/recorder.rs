//! Recording of received messages while the display runs.

use std::path::PathBuf;

use crate::ros::Bridge;
use feet::{Session, Update};

use crate::error::Error;
use crate::files::OutputError;
use crate::mcap_recording::{Existing, McapRecording};
use crate::stream::Sink;

/// Recorder of received messages to a file.
pub struct Recorder {
    /// Path of the file.
    pub(super) path: PathBuf,
    bridge: Bridge,
    pub(super) to: McapRecording,
}

impl Recorder {
    /// Starts a recording in the current directory, under the first unused name of `footfall-1.mcap`,
    /// `footfall-2.mcap`, ….
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn begin() -> Result<Self, OutputError> {
        let mut number = 1_u32;
        loop {
            let path = PathBuf::from(format!("footfall-{number}.mcap"));
            let to = match McapRecording::create(&path, Existing::Kept) {
                Err(OutputError::Exists(_)) => {
                    number += 1;
                    continue;
                }
                created => created?,
            };
            let bridge = Bridge::default();
            return Ok(Self { path, bridge, to });
        }
    }

    /// Records the messages of an update of the feet.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn record(&mut self, session: &Session, update: &Update) -> Result<(), Error> {
        let mut messages = self.bridge.messages(session, update).into_iter();
        messages.try_for_each(|published| self.to.publish(published))
    }
}
