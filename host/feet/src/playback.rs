//! Playback of the recording of an IMU: how it is read, and how it is estimated.

use recordings::config::Resolved;
use recordings::input::{ContactUse, Hints};

/// How the recording of an IMU is read that is played, and the settings of its estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    /// Properties of the file beyond its format.
    pub hints: Hints,
    /// Preset, configuration and options.
    pub settings: Resolved,
    /// Names of the given options that change an estimate and nothing else.
    pub estimator_options: Vec<&'static str>,
}

impl Default for Playback {
    /// Contacts that a bag has of its feet are the estimates.
    fn default() -> Self {
        Self {
            hints: Hints { contacts: ContactUse::Recorded, ..Hints::default() },
            settings: Resolved::default(),
            estimator_options: Vec::new(),
        }
    }
}
