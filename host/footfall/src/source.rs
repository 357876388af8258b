//! Source of the feet that a command reads, with the syntax that all commands share.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use feet::source::{SourceError, Speed};
use feet::{LineSource, Link, LinkError, Playback};
use simulated_robot::{Demo, DemoError};
use thiserror::Error;

/// Prefix of simulated feet.
const DEMO: &str = "demo";

/// Source of the feet.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A line or a file.
    Line(feet::Source),
    /// Simulated feet.
    Demo(Demo),
}

/// Error in the text of a source.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SourceTextError {
    /// The kind of source is unknown.
    #[error("{0}, or demo[:feet=4] for simulated feet")]
    Unknown(SourceError),
    /// The text of a line or a file is invalid.
    #[error(transparent)]
    Line(SourceError),
    /// The options of simulated feet are invalid.
    #[error(transparent)]
    Demo(#[from] DemoError),
}

impl From<SourceError> for SourceTextError {
    fn from(error: SourceError) -> Self {
        match error {
            SourceError::Unknown(_) | SourceError::NoneOnUsb => Self::Unknown(error),
            error => Self::Line(error),
        }
    }
}

impl FromStr for Source {
    type Err = SourceTextError;

    fn from_str(text: &str) -> Result<Self, SourceTextError> {
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        if kind == DEMO {
            return Ok(Self::Demo(rest.parse()?));
        }
        Ok(Self::Line(text.parse()?))
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => line.fmt(f),
            Self::Demo(demo) => demo.fmt(f),
        }
    }
}

impl Source {
    /// Path of the file that is played, if the source is a file.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Line(line) => line.file(),
            Self::Demo(_) => None,
        }
    }

    /// Sets how a recording of an IMU is read and estimated; other sources stay as they are.
    #[must_use]
    pub fn played_with(self, playback: Playback) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.played_with(playback)),
            demo @ Self::Demo(_) => demo,
        }
    }

    /// Sets the speed of a playback if its text has none.
    #[must_use]
    pub fn at_speed(self, speed: Speed) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.at_speed(speed)),
            Self::Demo(demo) => Self::Demo(demo.at_speed(speed)),
        }
    }

    fn line(&self) -> &dyn LineSource {
        match self {
            Self::Line(line) => line,
            Self::Demo(demo) => demo,
        }
    }
}

impl LineSource for Source {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        self.line().open()
    }

    fn open_for_requests(&self) -> Result<Box<dyn Link>, LinkError> {
        self.line().open_for_requests()
    }

    fn is_played(&self) -> bool {
        self.line().is_played()
    }

    fn is_in_lock_step(&self) -> bool {
        self.line().is_in_lock_step()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_source_error_lists_all_kinds() {
        let error = "/dev/ttyACM0".parse::<Source>().expect_err("no source").to_string();
        assert_eq!(
            error,
            "\"/dev/ttyACM0\" is no source; sources are usb, uart:PORT[@BAUD], can:INTERFACE, slcan:PORT[@KBIT] and file:PATH[@SPEED], or demo[:feet=4] for simulated feet"
        );
        assert_eq!("demo".parse(), Ok(Source::Demo(Demo::default())));
    }
}
