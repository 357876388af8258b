//! Conversion of parameters to the estimator's configuration: [`Params::validate`].

use crate::attitude::{AttitudeCoefficients, AttitudeFilter, GyroTiming};
use crate::kde::{DensityEstimator, KdeConfig, Kernel};
use crate::math::rounded;
use crate::parameter;
use crate::params::{Gravity, Method, Params, WindowLength};
use crate::phase::PhaseCoefficients;
use crate::range::ParamsError;
use crate::roll::Roll;
use crate::self_calibrating::SelfCalibratingConfig;
use crate::velocity::VelocityCoefficients;

impl Params {
    /// Checks every field and computes the configuration of the estimator, for [`Method::SelfCalibrating`].
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range; NaN is out of every
    /// range. With [`Method::HalfWidths`] the window has to fit one sample: use
    /// [`Self::validate_for`].
    pub fn validate(&self) -> Result<Config, ParamsError> {
        self.validate_for()
    }

    /// Checks every field and computes the configuration of an estimator with room for `CAPACITY` samples in the window
    /// of [`Method::HalfWidths`]. With the other method the window is not checked.
    ///
    /// # Errors
    /// As those of [`Self::validate`].
    pub fn validate_for<const CAPACITY: usize>(&self) -> Result<Config<CAPACITY>, ParamsError> {
        self.check()?;
        Ok(Config { params: *self, window_length: self.window_samples::<CAPACITY>()? })
    }

    /// Checks every field as [`Self::validate`] does, except the window.
    ///
    /// # Errors
    /// As those of [`Self::validate`].
    pub fn check(&self) -> Result<(), ParamsError> {
        parameter::check(self)?;
        if let GyroTiming::Delay(delay) = self.attitude.gyro_timing {
            parameter::GYRO_DELAY.check(delay)?;
        }
        match &self.learnt {
            Some(learnt) => learnt.validate(),
            None => Ok(()),
        }
    }

    /// Length of the window in samples; without half-widths the nearest length that fits.
    fn window_samples<const CAPACITY: usize>(&self) -> Result<usize, ParamsError> {
        const { assert!(CAPACITY > 0) };
        let is_used = self.method == Method::HalfWidths;
        let samples = match self.window {
            WindowLength::Duration(seconds) => {
                if is_used {
                    parameter::WINDOW.check(seconds)?;
                }
                rounded(seconds * self.sample_rate)
            }
            WindowLength::Samples(samples) => samples,
        };
        let fitting = (samples as usize).clamp(1, CAPACITY);
        if is_used && fitting != samples as usize {
            return Err(ParamsError::WindowLength { samples, capacity: CAPACITY });
        }
        Ok(fitting)
    }
}

/// Validated parameters in the form used by the estimator. Only
/// [`Params::validate`] and [`Params::validate_for`] create it.
#[derive(Clone, Debug)]
pub struct Config<const CAPACITY: usize = 1> {
    /// The checked parameters. Derived values are computed where they are kept, so that a start needs little stack.
    params: Params,
    /// Length of the window in samples, 1 to the capacity.
    window_length: usize,
}

impl<const CAPACITY: usize> Config<CAPACITY> {
    /// Length of the window in samples.
    #[must_use]
    pub const fn window_length(&self) -> usize {
        self.window_length
    }

    pub(crate) const fn gravity(&self) -> Gravity {
        self.params.gravity
    }

    pub(crate) const fn method(&self) -> Method {
        self.params.method
    }

    /// Time between samples, µs.
    pub(crate) fn period_us(&self) -> u64 {
        u64::from(rounded(1.0e6 / self.params.sample_rate))
    }

    pub(crate) fn kde(&self) -> KdeConfig {
        KdeConfig {
            kernels: self.params.bandwidth.zip_with(self.params.half_width, Kernel::new),
            window_length: self.window_length,
        }
    }

    pub(crate) const fn self_calibrating(&self) -> SelfCalibratingConfig<'_> {
        let Params { constants, learning, learnt, sample_rate, .. } = &self.params;
        SelfCalibratingConfig::new(constants, *learning, *learnt, *sample_rate)
    }

    pub(crate) fn attitude(&self) -> AttitudeCoefficients {
        AttitudeCoefficients::new(&self.params.attitude, self.params.sample_rate)
    }

    pub(crate) fn phase(&self) -> PhaseCoefficients {
        let Params { decision, load, .. } = &self.params;
        PhaseCoefficients {
            threshold: decision.threshold,
            on_delay_us: micros(decision.on_delay),
            off_delay_us: micros(decision.off_delay),
            load_on: load.on_threshold,
            load_off: load.off_threshold,
        }
    }

    pub(crate) fn roll(&self) -> Roll {
        Roll::new(self.period_us(), &self.params.velocity)
    }

    pub(crate) const fn velocity(&self) -> VelocityCoefficients {
        VelocityCoefficients::new(&self.params.velocity)
    }
}

impl AttitudeFilter {
    /// Creates an attitude filter without samples, for use without an estimator.
    #[must_use]
    #[inline(never)] // Its temporary values leave the stack.
    pub fn new<const CAPACITY: usize>(config: &Config<CAPACITY>) -> Self {
        Self::with_coefficients(config.attitude())
    }
}

impl<const CAPACITY: usize> DensityEstimator<CAPACITY> {
    /// Creates a kernel density estimate without samples, with the half-widths, bandwidths and window of `config`.
    #[must_use]
    pub fn new(config: &Config<CAPACITY>) -> Self {
        Self::with_config(&config.kde())
    }
}

/// Microseconds of a duration in s.
fn micros(seconds: f32) -> u64 {
    u64::from(rounded(seconds * 1.0e6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learnt::Learnt;

    fn field_refused(change: impl FnOnce(&mut Params)) -> &'static str {
        let mut params = Params::DEFAULT;
        change(&mut params);
        match params.validate_for::<256>() {
            Err(ParamsError::OutOfRange { field, .. }) => field,
            Err(ParamsError::WindowLength { .. }) => "window",
            Ok(_) => "nothing",
        }
    }

    #[test]
    fn presets_are_valid() {
        for preset in [Params::DEFAULT, Params::PAPER, Params::PAPER_GO1] {
            assert_eq!(preset.validate_for::<256>().map(|config| config.window_length()), Ok(50));
        }
    }

    #[test]
    fn window_length_is_its_duration_times_the_sample_rate() {
        let params = Params { sample_rate: 200.0, ..Params::DEFAULT };
        assert_eq!(params.validate_for::<256>().map(|c| c.window_length()), Ok(10));
    }

    #[test]
    fn out_of_range_number_is_rejected_with_its_field_name() {
        type Set = fn(&mut Params, f32);
        const LEARNT: Learnt = Learnt {
            still: -1.0,
            moving: 1.0,
            speed: -5.0,
            still_seconds: 1.0,
            moving_seconds: 1.0,
        };
        // Each field with a value just below its range and one just above it.
        let fields: [(&str, Set, f32, f32); 20] = [
            ("sample_rate_hz", |p, v| p.sample_rate = v, 19.9, 10_001.0),
            ("bandwidth.acceleration_m_s2.ax", |p, v| p.bandwidth.ax = v, 0.9e-6, 1.1e3),
            ("bandwidth.angular_rate_rad_s.wz", |p, v| p.bandwidth.wz = v, 0.9e-6, 1.1e3),
            ("half_width.acceleration_m_s2.ay", |p, v| p.half_width.ay = v, 0.9e-6, 10.1),
            ("half_width.angular_rate_rad_s.wx", |p, v| p.half_width.wx = v, -0.04, 3.1),
            ("decision.threshold", |p, v| p.decision.threshold = v, 0.0, 1.0),
            ("decision.on_delay_s", |p, v| p.decision.on_delay = v, -0.1, 10.1),
            ("decision.off_delay_s", |p, v| p.decision.off_delay = v, -0.1, 0.21),
            ("load.on_threshold", |p, v| p.load.on_threshold = v, -2.0e9, 2.0e9),
            ("load.off_threshold", |p, v| p.load.off_threshold = v, -2.0e9, 12.1),
            ("learnt.speed", |p, v| p.learnt = Some(Learnt { speed: v, ..LEARNT }), -12.0, 0.1),
            (
                "learnt.moving_seconds",
                |p, v| {
                    p.learnt = Some(Learnt { moving_seconds: v, ..LEARNT });
                },
                -0.1,
                1.1e3,
            ),
            (
                "attitude.gyro_timing",
                |p, v| p.attitude.gyro_timing = GyroTiming::Delay(v),
                -0.001,
                0.051,
            ),
            (
                "attitude.motion_time_constant_s",
                |p, v| p.attitude.motion_time_constant = v,
                0.09,
                101.0,
            ),
            ("attitude.quiet_gain", |p, v| p.attitude.quiet_gain = v, 0.9, 1.1e4),
            (
                "attitude.quiet_acceleration_m_s2",
                |p, v| p.attitude.quiet_acceleration = v,
                0.9e-3,
                11.0,
            ),
            ("attitude.quiet_rate_rad_s", |p, v| p.attitude.quiet_rate = v, 0.9e-4, 1.1),
            ("attitude.rest.duration_s", |p, v| p.attitude.rest.duration = v, 0.09, 101.0),
            ("attitude.rest.bias_limit_rad_s", |p, v| p.attitude.rest.bias_limit = v, -0.1, 1.1),
            (
                "attitude.rest.bias_time_constant_s",
                |p, v| p.attitude.rest.bias_time_constant = v,
                0.09,
                1.1e3,
            ),
        ];
        for (field, set, low, high) in fields {
            for value in [low, high, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert_eq!(field_refused(|p| set(p, value)), field, "{value}");
            }
        }
        for (field, set) in [
            ("attitude.rest.acceleration_m_s2", (|p, v| p.attitude.rest.acceleration = v) as Set),
            ("attitude.rest.rate_rad_s", |p, v| p.attitude.rest.rate = v),
        ] {
            assert_eq!(field_refused(|p| set(p, 0.0)), field);
            assert_eq!(field_refused(|p| set(p, 11.0)), field);
        }
    }

    #[test]
    fn empty_or_oversized_window_is_rejected() {
        for window in [
            WindowLength::Duration(0.3),
            WindowLength::Duration(-0.05),
            WindowLength::Duration(f32::NAN),
            WindowLength::Samples(0),
            WindowLength::Samples(257),
        ] {
            let half_widths = |p: &mut Params| {
                (p.method, p.window) = (Method::HalfWidths, window);
            };
            assert_eq!(field_refused(half_widths), "window", "{window:?}");
            // The other method has no window.
            assert_eq!(field_refused(|p| p.window = window), "nothing", "{window:?}");
        }
    }
}
