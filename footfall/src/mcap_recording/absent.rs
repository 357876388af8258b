//! A recording that cannot be made: this program does not write MCAP.

use std::path::Path;

use ros::Published;

use super::Existing;
use crate::error::Error;
use crate::feature::Feature;
use crate::files::OutputError;
use crate::stream::Sink;

/// There is none.
pub enum McapRecording {}

impl McapRecording {
    /// Says what it takes.
    ///
    /// # Errors
    /// Always.
    pub fn create(path: &Path, _: Existing) -> Result<Self, OutputError> {
        Err(Feature::Bags.missing_for(path.display()).into())
    }

    /// Its name.
    #[must_use]
    pub fn path(&self) -> &Path {
        match *self {}
    }

    /// Never.
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

    fn idle(&mut self) -> Result<(), Error> {
        match *self {}
    }
}
