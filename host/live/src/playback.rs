//! Playback of the recording of an IMU: how it is read, and how it is estimated.

use analysis::config::Resolved;
use recordings::input::Hints;

/// How the recording of an IMU is read that is played, and the settings of its estimates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Playback {
    /// Properties of the file beyond its format.
    pub hints: Hints,
    /// Preset, configuration and options.
    pub settings: Resolved,
}
