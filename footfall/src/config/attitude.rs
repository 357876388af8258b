//! The attitude filter's keys.

use estimator_core::{AttitudeParams, GyroTiming, RestParams};
use serde::{Deserialize, Deserializer};

use super::set;
use super::value::parse_gyro_timing;

/// What differs in [`AttitudeParams`].
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct AttitudeOverrides {
    /// When the gyroscope measured what a sample says, as [`parse_gyro_timing`] reads it.
    #[serde(default, deserialize_with = "gyro_timing")]
    pub gyro_timing: Option<GyroTiming>,
    /// Time constant of the inclination correction while the foot moves, s.
    pub motion_time_constant_s: Option<f32>,
    /// How many times faster the correction is where the foot is perfectly quiet.
    pub quiet_gain: Option<f32>,
    /// Deviation of the acceleration that still counts as quiet, m/s².
    pub quiet_acceleration_m_s2: Option<f32>,
    /// Angular rate that still counts as quiet, rad/s.
    pub quiet_rate_rad_s: Option<f32>,
    /// Rest detection and bias estimation.
    #[serde(default)]
    pub rest: RestOverrides,
}

/// What differs in [`RestParams`].
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct RestOverrides {
    /// How long the sensor must be still before it counts as rest, s.
    pub duration_s: Option<f32>,
    /// Largest deviation of the acceleration from its mean at rest, m/s².
    pub acceleration_m_s2: Option<f32>,
    /// Largest deviation of the angular rate from its mean at rest, rad/s.
    pub rate_rad_s: Option<f32>,
    /// Largest bias per axis that is believed, rad/s.
    pub bias_limit_rad_s: Option<f32>,
    /// Time constant of the bias estimate at rest, s.
    pub bias_time_constant_s: Option<f32>,
}

impl AttitudeOverrides {
    pub(super) fn apply(&self, params: &mut AttitudeParams) {
        // Taken apart, so that a parameter without a key does not compile.
        let AttitudeParams {
            gyro_timing,
            motion_time_constant,
            quiet_gain,
            quiet_acceleration,
            quiet_rate,
            rest,
        } = params;
        set(gyro_timing, self.gyro_timing);
        set(motion_time_constant, self.motion_time_constant_s);
        set(quiet_gain, self.quiet_gain);
        set(quiet_acceleration, self.quiet_acceleration_m_s2);
        set(quiet_rate, self.quiet_rate_rad_s);
        self.rest.apply(rest);
    }
}

impl RestOverrides {
    fn apply(&self, params: &mut RestParams) {
        let RestParams {
            duration,
            acceleration,
            rate,
            bias_limit,
            bias_time_constant,
        } = params;
        set(duration, self.duration_s);
        set(acceleration, self.acceleration_m_s2);
        set(rate, self.rate_rad_s);
        set(bias_limit, self.bias_limit_rad_s);
        set(bias_time_constant, self.bias_time_constant_s);
    }
}

fn gyro_timing<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<GyroTiming>, D::Error> {
    let text = String::deserialize(deserializer)?;
    parse_gyro_timing(&text)
        .map(Some)
        .map_err(serde::de::Error::custom)
}
