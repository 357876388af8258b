//! The estimator of a foot, with the settings that apply to a sample on its way to the estimator.

use estimator_core::any::{AnyConfig, AnyEstimator};
use estimator_core::correction::AccelerometerCorrection;
use estimator_core::half_widths::WindowLength;
use estimator_core::mounting::Mounting;
use estimator_core::{ContactEstimate, Gravity, ImuSample, Learnt, Load, Stream};
use lsm6dsox::scale::DEGREE;
use wire::Settings;
use wire::settings::WINDOW_CAPACITY;

/// Estimator, with the axes and the correction of its samples.
#[derive(Debug)]
pub(crate) struct Estimation {
    estimator: AnyEstimator<WINDOW_CAPACITY>,
    accelerometer: AccelerometerCorrection,
    mounting: Mounting,
    /// Pending request for a new estimator.
    renewal: Option<Renewal>,
}

/// Start of a new estimator. Of two requests, the greater takes precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Renewal {
    /// With the values learnt by the previous one.
    Continue,
    /// With the learnt values of the settings.
    Restart,
}

impl Estimation {
    /// Creates an estimator with the configuration of `settings`.
    #[inline]
    pub(crate) fn new(settings: &Settings, config: &AnyConfig<WINDOW_CAPACITY>) -> Self {
        Self {
            estimator: AnyEstimator::new(config),
            accelerometer: settings.accelerometer(),
            mounting: settings.mounting(),
            renewal: None,
        }
    }

    /// Uses the axes and the correction of `settings` from the next sample on.
    pub(crate) fn use_settings(&mut self, settings: &Settings) {
        self.accelerometer = settings.accelerometer();
        self.mounting = settings.mounting();
    }

    /// Requests a new estimator, from the next sample on.
    pub(crate) fn renew(&mut self, renewal: Renewal) {
        self.renewal = self.renewal.max(Some(renewal));
    }

    /// Estimates from a sample along the sensor's axes. If a new estimator was requested, first creates it with the
    /// parameters of `settings`, for a sample each `tick_us`. A window shorter than a tick holds one sample.
    pub(crate) fn update(
        &mut self,
        mut sample: ImuSample,
        load: Option<Load>,
        settings: &Settings,
        tick_us: u32,
    ) -> ContactEstimate {
        if let Some(renewal) = self.renewal.take() {
            self.replace(renewal, settings, tick_us);
        }
        // (Reading − bias) × scale, along the sensor's axes. Then both vectors are rotated to the axes of the foot.
        sample.specific_force = self.accelerometer.apply(sample.specific_force);
        self.mounting.apply(&mut sample.specific_force, &mut sample.angular_rate);
        self.estimator.update(&sample, load)
    }

    fn replace(&mut self, renewal: Renewal, settings: &Settings, tick_us: u32) {
        let mut params = settings.params();
        if renewal == Renewal::Continue {
            params.params.learnt = Some(self.learnt());
        }
        // Settings allow a window of a millisecond, which contains no sample if the ticks are slower.
        if let WindowLength::Duration(seconds) = &mut params.half_widths.window {
            *seconds = seconds.max(1.0e-6 * tick_us as f32);
        }
        let stream = Stream::new(1.0e6 / tick_us as f32, Gravity::Included);
        let config = stream.and_then(|stream| params.validate(stream));
        // No error is possible with ticks of 1 to 50 ms. The settings were checked at 1 kHz, and slower ticks only make
        // their window shorter. An estimator limits what it has learnt to the checked ranges.
        debug_assert!(config.is_ok(), "ticks of {tick_us} µs: {config:?}");
        if let Ok(config) = config {
            self.estimator = AnyEstimator::new(&config);
        }
    }

    /// Values learnt so far.
    pub(crate) fn learnt(&self) -> Learnt {
        self.estimator.learnt()
    }

    /// Bias of the gyroscope, m°/s, if it is too large to be learnt.
    pub(crate) fn excess_bias(&self) -> Option<u32> {
        let rate = self.estimator.excess_bias()?;
        Some((rate.0.length() * (1000.0 / DEGREE)) as u32)
    }

    /// Specific force of the last rest, m/s².
    pub(crate) fn force_at_rest(&self) -> Option<f32> {
        self.estimator.force_at_rest()
    }
}
