//! Either estimator, for a board or a program whose user chooses the method at run time.

use crate::config::Config;
use crate::contact::ContactEstimator;
use crate::estimate::ContactEstimate;
use crate::half_widths::{HalfWidthConfig, HalfWidthEstimator};
use crate::learnt::Learnt;
use crate::parameter;
use crate::phase::Load;
use crate::pipeline::Pipeline;
use crate::range::ParamsError;
use crate::sample::{AngularRate, ImuSample, Timestamp};
use crate::stream::Stream;

pub use crate::params::{AnyParams, Method};

/// Checked parameters for the samples of one stream. Only [`AnyParams::validate`] creates them.
#[derive(Clone, Debug)]
pub enum AnyConfig<const CAPACITY: usize> {
    /// Estimator of [`Method::SelfCalibrating`].
    SelfCalibrating(Config, Stream),
    /// Of [`Method::HalfWidths`], with a window of at most `CAPACITY` samples.
    HalfWidths(HalfWidthConfig<CAPACITY>),
}

impl AnyParams {
    /// Checks every field, including those that the chosen method does not use. Only [`Method::HalfWidths`] checks the window.
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range, or a window that contains no sample at
    /// the rate of the stream, or more than `CAPACITY`.
    pub fn validate<const CAPACITY: usize>(
        &self,
        stream: Stream,
    ) -> Result<AnyConfig<CAPACITY>, ParamsError> {
        Ok(match self.method {
            Method::SelfCalibrating => {
                let config = self.params.validate()?;
                parameter::check_half_widths(&self.half_widths)?;
                AnyConfig::SelfCalibrating(config, stream)
            }
            Method::HalfWidths => {
                AnyConfig::HalfWidths(self.half_widths.validate(&self.params, stream)?)
            }
        })
    }
}

/// The estimator of one foot, with the method that was chosen.
#[derive(Clone, Debug)]
// The larger variant is not boxed, because that needs an allocator, and the estimator is not moved once it is built.
#[allow(clippy::large_enum_variant)]
pub enum AnyEstimator<const CAPACITY: usize> {
    /// Estimator of [`Method::SelfCalibrating`].
    SelfCalibrating(ContactEstimator),
    /// Estimator of [`Method::HalfWidths`], with the learnt state of the parameters, which it does not change.
    HalfWidths(HalfWidthEstimator<CAPACITY>, Learnt),
}

impl<const CAPACITY: usize> AnyEstimator<CAPACITY> {
    /// An estimator without samples.
    #[must_use]
    #[inline(never)] // Built where the caller keeps it, without a copy on the stack if the compiler can.
    pub fn new(config: &AnyConfig<CAPACITY>) -> Self {
        match config {
            AnyConfig::SelfCalibrating(config, stream) => {
                Self::SelfCalibrating(ContactEstimator::new(config, *stream))
            }
            AnyConfig::HalfWidths(config) => {
                Self::HalfWidths(HalfWidthEstimator::new(config), config.config.learnt())
            }
        }
    }

    /// Processes the next sample, and the load on the foot at that time if it is known; see
    /// [`ContactEstimator::update`].
    #[inline]
    pub fn update(&mut self, sample: &ImuSample, load: Option<Load>) -> ContactEstimate {
        match self {
            Self::SelfCalibrating(estimator) => estimator.update(sample, load),
            Self::HalfWidths(estimator, _) => estimator.update(sample, load),
        }
    }

    /// State learnt so far; with [`Method::HalfWidths`], which learns nothing, the state in the parameters.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        match self {
            Self::SelfCalibrating(estimator) => estimator.learnt(),
            Self::HalfWidths(_, learnt) => *learnt,
        }
    }

    /// Bias of the gyroscope, rad/s; see [`ContactEstimator::gyro_bias`].
    #[must_use]
    pub fn gyro_bias(&self) -> Option<AngularRate> {
        self.pipeline().attitude.known_bias()
    }

    /// Angular rate at rest that was not accepted as the bias, rad/s; see [`ContactEstimator::excess_bias`].
    #[must_use]
    pub fn excess_bias(&self) -> Option<AngularRate> {
        self.pipeline().attitude.excess_bias()
    }

    /// Length of the mean specific force at rest, m/s²; see [`ContactEstimator::force_at_rest`].
    #[must_use]
    pub fn force_at_rest(&self) -> Option<f32> {
        self.pipeline().attitude.force_at_rest()
    }

    /// Length of the mean specific force, m/s², if no foot can have it; see [`ContactEstimator::implausible_force`].
    #[must_use]
    pub fn implausible_force(&self) -> Option<f32> {
        self.pipeline().attitude.implausible_force()
    }

    /// Times of samples that were read at once; see [`ContactEstimator::batch_timestamps`].
    pub fn batch_timestamps(
        &self,
        newest: Timestamp,
        count: usize,
    ) -> impl ExactSizeIterator<Item = Timestamp> + DoubleEndedIterator + use<CAPACITY> {
        self.pipeline().batch_timestamps(newest, count)
    }

    const fn pipeline(&self) -> &Pipeline {
        match self {
            Self::SelfCalibrating(estimator) => estimator.pipeline(),
            Self::HalfWidths(estimator, _) => estimator.pipeline(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::{GyroTiming, HalfWidthParams, WindowLength};

    fn field_refused(change: impl FnOnce(&mut AnyParams)) -> &'static str {
        let mut params = AnyParams::DEFAULT;
        change(&mut params);
        match params.validate::<256>(Stream::KILOHERTZ) {
            Err(ParamsError::OutOfRange { field, .. }) => field,
            Err(ParamsError::WindowLength { .. }) => "window",
            Err(ParamsError::UnknownConstant) => "constant",
            Ok(_) => "nothing",
        }
    }

    #[test]
    fn out_of_range_number_is_rejected_with_its_field_name() {
        type Set = fn(&mut AnyParams, f32);
        const LEARNT: Learnt = Learnt {
            still: -1.0,
            moving: 1.0,
            speed: -5.0,
            still_seconds: 1.0,
            moving_seconds: 1.0,
        };
        // Each field with a value just below its range and one just above it.
        let fields: [(&str, Set, f32, f32); 19] = [
            (
                "bandwidth.acceleration_m_s2.ax",
                |p, v| p.half_widths.bandwidth.ax = v,
                0.9e-6,
                1.1e3,
            ),
            (
                "bandwidth.angular_rate_rad_s.wz",
                |p, v| p.half_widths.bandwidth.wz = v,
                0.9e-6,
                1.1e3,
            ),
            (
                "half_width.acceleration_m_s2.ay",
                |p, v| p.half_widths.half_width.ay = v,
                0.9e-6,
                10.1,
            ),
            (
                "half_width.angular_rate_rad_s.wx",
                |p, v| p.half_widths.half_width.wx = v,
                -0.04,
                3.1,
            ),
            ("decision.threshold", |p, v| p.params.decision.threshold = v, 0.0, 1.0),
            ("decision.on_delay_s", |p, v| p.params.decision.on_delay = v, -0.1, 10.1),
            ("decision.off_delay_s", |p, v| p.params.decision.off_delay = v, -0.1, 0.21),
            ("load.on_threshold", |p, v| p.params.load.on_threshold = v, -2.0e9, 2.0e9),
            ("load.off_threshold", |p, v| p.params.load.off_threshold = v, -2.0e9, 12.1),
            (
                "learnt.speed",
                |p, v| p.params.learnt = Some(Learnt { speed: v, ..LEARNT }),
                -12.0,
                0.1,
            ),
            (
                "learnt.moving_seconds",
                |p, v| {
                    p.params.learnt = Some(Learnt { moving_seconds: v, ..LEARNT });
                },
                -0.1,
                1.1e3,
            ),
            (
                "attitude.gyro_timing",
                |p, v| p.params.attitude.gyro_timing = GyroTiming::Delay(v),
                -0.001,
                0.051,
            ),
            (
                "attitude.motion_time_constant_s",
                |p, v| p.params.attitude.motion_time_constant = v,
                0.09,
                101.0,
            ),
            ("attitude.quiet_gain", |p, v| p.params.attitude.quiet_gain = v, 0.9, 1.1e4),
            (
                "attitude.quiet_acceleration_m_s2",
                |p, v| p.params.attitude.quiet_acceleration = v,
                0.9e-3,
                11.0,
            ),
            ("attitude.quiet_rate_rad_s", |p, v| p.params.attitude.quiet_rate = v, 0.9e-4, 1.1),
            ("attitude.rest.duration_s", |p, v| p.params.attitude.rest.duration = v, 0.09, 101.0),
            (
                "attitude.rest.bias_limit_rad_s",
                |p, v| p.params.attitude.rest.bias_limit = v,
                -0.1,
                1.1,
            ),
            (
                "attitude.rest.bias_time_constant_s",
                |p, v| p.params.attitude.rest.bias_time_constant = v,
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
            (
                "attitude.rest.acceleration_m_s2",
                (|p, v| p.params.attitude.rest.acceleration = v) as Set,
            ),
            ("attitude.rest.rate_rad_s", |p, v| p.params.attitude.rest.rate = v),
        ] {
            assert_eq!(field_refused(|p| set(p, 0.0)), field);
            assert_eq!(field_refused(|p| set(p, 11.0)), field);
        }
    }

    #[test]
    fn window_is_checked_with_half_widths_only() {
        let window = WindowLength::Samples(257);
        for (method, expected) in
            [(Method::HalfWidths, "window"), (Method::SelfCalibrating, "nothing")]
        {
            let refused = field_refused(|p| {
                *p = AnyParams {
                    method,
                    half_widths: HalfWidthParams { window, ..p.half_widths },
                    ..*p
                };
            });
            assert_eq!(refused, expected);
        }
    }

    #[test]
    fn learnt_state_survives_half_widths() {
        let learnt = Learnt {
            still: -1.0,
            moving: 1.0,
            speed: -5.0,
            still_seconds: 0.25,
            moving_seconds: 0.25,
        };
        let mut params = AnyParams { method: Method::HalfWidths, ..AnyParams::DEFAULT };
        params.params.learnt = Some(learnt);
        let config = params.validate::<64>(Stream::KILOHERTZ).expect("valid parameters");
        assert_eq!(AnyEstimator::new(&config).learnt(), learnt);
    }
}
