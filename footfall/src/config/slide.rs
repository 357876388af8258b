//! The slide's keys.

use estimator_core::SlideParams;
use serde::Deserialize;

use super::set;

/// What differs in [`SlideParams`]. Where the preset has none, what is not said is the default's.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SlideOverrides {
    /// Whether speed is looked at; it is where another key is given.
    pub mode: Option<SlideMode>,
    /// Least half-width of the speed along each axis, m/s.
    pub speed_m_s: Option<f32>,
    /// The time over which speed is remembered, s.
    pub time_constant_s: Option<f32>,
}

/// Whether speed is looked at.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum SlideMode {
    /// Speed and accelerations.
    On,
    /// Accelerations only, as in the paper.
    Off,
}

impl SlideOverrides {
    pub(super) fn apply(&self, params: &mut Option<SlideParams>) {
        match self.mode {
            Some(SlideMode::Off) => *params = None,
            Some(SlideMode::On) => {
                params.get_or_insert(SlideParams::DEFAULT);
            }
            None => {}
        }
        let said = self.speed_m_s.is_some() || self.time_constant_s.is_some();
        if said && self.mode != Some(SlideMode::Off) {
            let SlideParams {
                speed,
                time_constant,
            } = params.get_or_insert(SlideParams::DEFAULT);
            set(speed, self.speed_m_s);
            set(time_constant, self.time_constant_s);
        }
    }
}
