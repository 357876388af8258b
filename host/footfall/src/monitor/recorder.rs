//! Recording of received messages while the display runs.

use std::path::Path;

use live::{Session, Update};
use ros::Bridge;

use crate::error::Error;
use crate::files::OutputError;
use crate::mcap_recording::{Existing, McapRecording};
use crate::stream::Sink;

/// A recording in progress.
pub struct Recorder {
    bridge: Bridge,
    to: McapRecording,
}

impl Recorder {
    /// Starts a recording in the current directory, under the first unused name of `footfall-1.mcap`,
    /// `footfall-2.mcap`, ….
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin() -> Result<Self, OutputError> {
        let mut number = 1_u32;
        let to = loop {
            let path = format!("footfall-{number}.mcap");
            match McapRecording::create(path.as_ref(), Existing::Kept) {
                Err(OutputError::Exists(_)) => number += 1,
                created => break created?,
            }
        };
        let bridge = Bridge::default();
        Ok(Self { bridge, to })
    }

    /// Returns the path of the file.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.to.path()
    }

    /// Records the messages of an update of the feet.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn record(&mut self, session: &Session, update: &Update) -> Result<(), Error> {
        let mut messages = self.bridge.messages(session, update).into_iter();
        messages.try_for_each(|published| self.to.publish(published))
    }

    /// Closes the recording.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<(), OutputError> {
        self.to.finish().map(|_| ())
    }
}
