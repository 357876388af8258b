//! What the monitor hears, recorded beside the picture.

use std::path::{Path, PathBuf};

use decode::live::Heard;
use estimator_core::Timestamp;
use ros::Bridge;

use crate::error::Error;
use crate::files::OutputError;
use crate::mcap_recording::{Existing, McapRecording};
use crate::stream::Sink;

/// A recording that runs.
pub struct Recorder {
    bridge: Bridge,
    to: McapRecording,
}

impl Recorder {
    /// Begins a recording in the current folder, under the first of the names `footfall-1.mcap`,
    /// `footfall-2.mcap`, … that is free.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin() -> Result<Self, OutputError> {
        let mut number = 1_u32;
        loop {
            let path = PathBuf::from(format!("footfall-{number}.mcap"));
            match McapRecording::create(&path, Existing::Kept) {
                Err(OutputError::Exists { .. }) => number += 1,
                created => {
                    return Ok(Self {
                        bridge: Bridge::default(),
                        to: created?,
                    });
                }
            }
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.to.path()
    }

    /// Records what was heard of a foot; `name` is what the foot is called, where it has a name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn record(&mut self, heard: &Heard, name: Option<&str>) -> Result<(), Error> {
        let mut messages = self.bridge.messages(heard, name).into_iter();
        messages.try_for_each(|published| self.to.publish(published))
    }

    /// Records what is due where nothing has come until `now`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn idle(&mut self, now: Timestamp) -> Result<(), Error> {
        let mut messages = self.bridge.idle(now).into_iter();
        messages.try_for_each(|published| self.to.publish(published))
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<(), OutputError> {
        self.to.finish().map(|_| ())
    }
}
