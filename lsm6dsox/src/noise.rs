//! Noise of the outputs at rest, from the part's noise density and the configured filter.
//!
//! The estimator's default kernel bandwidths are this noise at the foot's settings. The estimator has them as
//! constants, and a test compares the two.

use crate::config::Config;
use crate::scale::{AccelFullScale, DEGREE, STANDARD_GRAVITY};
use crate::setting::Odr;

/// The gyroscope's noise density, m°/s/√Hz, at any full scale \[D, S\].
pub const GYRO_MILLI_DPS_PER_ROOT_HERTZ: f32 = 3.8;

/// The accelerometer's noise density, µg/√Hz \[S\]. The values for ±4 g and ±16 g have several sources; those for ±2 g
/// and ±8 g are less certain.
#[must_use]
pub const fn accel_micro_g_per_root_hertz(full_scale: AccelFullScale) -> f32 {
    match full_scale {
        AccelFullScale::G2 => 70.0,
        AccelFullScale::G4 => 75.0,
        AccelFullScale::G8 => 80.0,
        AccelFullScale::G16 => 110.0,
    }
}

/// Standard deviation per axis at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// m/s²; `None` if the accelerometer is off or in low power.
    pub specific_force: Option<f32>,
    /// rad/s; `None` if the gyroscope is off or its cut-off is unknown.
    pub angular_rate: Option<f32>,
}

impl Config {
    /// Returns the noise density times the root of the cut-off frequency.
    ///
    /// The cut-off approximates the noise bandwidth, which for a second-order filter is 11 % wider. So a real part has
    /// some 5 % more noise, and rounding to whole codes adds to it.
    #[must_use]
    pub fn noise(&self) -> Noise {
        let accel = &self.params().accel;
        let accel_density =
            accel_micro_g_per_root_hertz(accel.full_scale) * 1.0e-6 * STANDARD_GRAVITY;
        let gyro_density = GYRO_MILLI_DPS_PER_ROOT_HERTZ * 1.0e-3 * DEGREE;
        let times_root_of = |density: f32| move |cutoff: f32| density * libm::sqrtf(cutoff);
        Noise {
            specific_force: self
                .accel_cutoff()
                .filter(|_| accel.odr != Odr::Hz1_6)
                .map(times_root_of(accel_density)),
            angular_rate: self.gyro_cutoff().map(times_root_of(gyro_density)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Params;
    use crate::setting::{AccelFilter, GyroFilter};

    #[test]
    fn the_preset_scatters_by_2_0_mg_and_0_070_degrees_a_second() {
        let noise = Config::FRESH_KILOHERTZ.noise();
        let milli_g = noise.specific_force.unwrap() / STANDARD_GRAVITY * 1000.0;
        let dps = noise.angular_rate.unwrap() / DEGREE;
        assert!((milli_g - 2.0).abs() < 0.02, "{milli_g} mg");
        assert!((dps - 0.070).abs() < 0.001, "{dps} °/s");
    }

    #[test]
    fn a_quarter_of_the_cut_off_halves_the_noise() {
        let mut params = Params::FRESH_KILOHERTZ;
        let noise = |params: &Params| params.validate().unwrap().noise().specific_force.unwrap();
        params.accel.filter = AccelFilter::OdrDiv100;
        let narrow = noise(&params);
        params.accel.filter = AccelFilter::OdrDiv400;
        assert!((noise(&params) / narrow - 0.5).abs() < 1.0e-6);
    }

    #[test]
    fn noise_behind_a_filter_of_unknown_cut_off_is_not_known() {
        let mut params = Params::FRESH_KILOHERTZ;
        params.gyro.odr = Odr::Hz3333;
        params.gyro.filter = GyroFilter::Lpf2;
        assert_eq!(params.validate().unwrap().noise().angular_rate, None);
    }
}
