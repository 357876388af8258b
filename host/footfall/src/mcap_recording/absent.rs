//! Stub for programs built without MCAP output.

use std::path::Path;

use crate::ros::Published;

use crate::error::Error;
use crate::feature::Feature;
use crate::files::OutputError;
use crate::stream::Sink;

/// Uninhabited: no recording can be created.
pub enum McapRecording {}

impl McapRecording {
    /// Fails with the feature required for MCAP.
    ///
    /// # Errors
    /// Always.
    pub fn create(path: &Path, _: bool) -> Result<Self, OutputError> {
        Err(Feature::Bags.missing_for(path.display()).into())
    }

    /// Never called.
    ///
    /// # Errors
    /// None.
    pub fn finish(self) -> Result<String, OutputError> {
        match self {}
    }
}

impl Sink for McapRecording {
    fn publish(&mut self, _: Published) -> Result<(), Error> {
        match *self {}
    }
}
