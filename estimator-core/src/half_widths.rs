//! The paper's estimator: limits of stillness that belong to one robot are given, as half-widths per axis.
//!
//! ```
//! use estimator_core::half_widths::{HalfWidthEstimator, HalfWidthParams};
//! use estimator_core::{Gravity, ImuSample, Params, Stream, Timestamp};
//!
//! let stream = Stream::new(1000.0, Gravity::Removed)?;
//! let config = HalfWidthParams::PAPER.validate(&Params::DEFAULT, stream)?;
//! let mut estimator = HalfWidthEstimator::<64>::new(&config);
//! let still = ImuSample { timestamp: Timestamp::from_micros(1000), ..Default::default() };
//! assert!(estimator.update(&still, None).probabilities.axes.ax > 0.99);
//! # Ok::<(), estimator_core::ParamsError>(())
//! ```
//!
//! The default estimator, [`ContactEstimator`](crate::ContactEstimator), learns its limits from the foot instead, and
//! needs no window. [`AnyEstimator`](crate::any::AnyEstimator) is either, for a program whose user chooses.

use crate::config::Config;
use crate::estimate::{ContactEstimate, Probabilities};
use crate::flags::Flag;
use crate::kde::DensityEstimator;
use crate::math::rounded;
use crate::parameter;
use crate::params::Params;
use crate::phase::Load;
use crate::pipeline::{Motion, Pipeline};
use crate::range::ParamsError;
use crate::sample::{AngularRate, ImuSample};
use crate::stream::Stream;

pub use crate::params::{HalfWidthParams, WindowLength};

/// Checked parameters of the paper's estimator for the samples of one stream, with a window of at most `CAPACITY`
/// samples. Only [`HalfWidthParams::validate`] creates them.
#[derive(Clone, Debug)]
pub struct HalfWidthConfig<const CAPACITY: usize> {
    pub(crate) config: Config,
    stream: Stream,
    half_widths: HalfWidthParams,
    /// Length of the window in samples, 1 to the capacity.
    window_length: usize,
}

impl HalfWidthParams {
    /// Checks every field, and every field of `params`, whose learning and constants have no effect.
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range, or a window that contains no sample at
    /// the rate of the stream, or more than `CAPACITY`.
    pub fn validate<const CAPACITY: usize>(
        &self,
        params: &Params,
        stream: Stream,
    ) -> Result<HalfWidthConfig<CAPACITY>, ParamsError> {
        let config = params.validate()?;
        parameter::check_half_widths(self)?;
        let window_length = self.window_samples(stream, CAPACITY)?;
        Ok(HalfWidthConfig { config, stream, half_widths: *self, window_length })
    }

    /// Length of the window in samples.
    fn window_samples(&self, stream: Stream, capacity: usize) -> Result<usize, ParamsError> {
        let samples = match self.window {
            WindowLength::Duration(seconds) => {
                parameter::WINDOW.check(seconds)?;
                rounded(seconds * stream.sample_rate())
            }
            WindowLength::Samples(samples) => samples,
        };
        if (1..=capacity).contains(&(samples as usize)) {
            Ok(samples as usize)
        } else {
            Err(ParamsError::WindowLength { samples, capacity })
        }
    }
}

impl<const CAPACITY: usize> HalfWidthConfig<CAPACITY> {
    /// Length of the window in samples.
    #[must_use]
    pub const fn window_length(&self) -> usize {
        self.window_length
    }

    /// Kernel density estimate of these parameters, for use without an estimator.
    #[doc(hidden)]
    #[must_use]
    pub fn density(&self) -> DensityEstimator<CAPACITY> {
        let HalfWidthParams { bandwidth, half_width, .. } = self.half_widths;
        DensityEstimator::new(bandwidth, half_width, self.window_length)
    }
}

/// The paper's estimator of one foot: attitude filter, density over a window of at most `CAPACITY` samples, and
/// decision.
#[derive(Clone, Debug)]
pub struct HalfWidthEstimator<const CAPACITY: usize> {
    pipeline: Pipeline,
    density: DensityEstimator<CAPACITY>,
}

impl<const CAPACITY: usize> HalfWidthEstimator<CAPACITY> {
    /// An estimator without samples.
    #[must_use]
    #[inline(never)] // Its temporary values are not on the stack of the other estimator.
    pub fn new(config: &HalfWidthConfig<CAPACITY>) -> Self {
        Self { pipeline: Pipeline::new(&config.config, config.stream), density: config.density() }
    }

    /// Processes the next sample, and the load on the foot at that time if it is known.
    ///
    /// Causal, O(1), and total: any bits are accepted, and the result is never NaN.
    #[inline(never)]
    pub fn update(&mut self, sample: &ImuSample, load: Option<Load>) -> ContactEstimate {
        let mut reading = self.pipeline.read(sample);
        self.account_for(reading.missing);
        let probabilities = match reading.motion {
            Motion::Known(acceleration, rate) => self.density.push(acceleration, rate),
            Motion::Unreliable => self.density.push_doubt(),
            // The remainder of gravity would count as motion.
            Motion::NoAttitude => {
                self.density.clear();
                Probabilities::default()
            }
        };
        if !self.density.is_full() {
            reading.flags = reading.flags.with(Flag::WindowNotFull);
        }
        // This method has no mean of the acceleration, so a turn alone shows that the foot rolls.
        self.pipeline.conclude(&reading, probabilities, f32::INFINITY, load)
    }

    /// Bias of the gyroscope, rad/s, frame of the foot, as in [`ContactEstimate::gyro_bias`]; `None` until the foot has
    /// been at rest, and with [`Gravity::Removed`](crate::Gravity::Removed).
    #[must_use]
    pub fn gyro_bias(&self) -> Option<AngularRate> {
        self.pipeline.attitude.known_bias()
    }

    /// Counts missing samples as mass 0.
    fn account_for(&mut self, missing: u64) {
        if missing + 1 >= self.density.window_length() as u64 && missing > 0 {
            // No sample in the window is recent.
            self.density.clear();
        } else {
            for _ in 0..missing {
                self.density.push_doubt();
            }
        }
    }

    pub(crate) const fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flags::Flags;
    use crate::phase::Decision;
    use crate::sample::{SpecificForce, Timestamp, Validity};
    use crate::stream::Gravity;
    use crate::units::STANDARD_GRAVITY;
    use crate::vector::Vec3;
    use std::vec::Vec;

    const GRAVITY_FREE: Stream = Stream::KILOHERTZ.with_gravity(Gravity::Removed);

    fn estimator(stream: Stream) -> HalfWidthEstimator<64> {
        let config = HalfWidthParams::DEFAULT.validate(&Params::DEFAULT, stream);
        HalfWidthEstimator::new(&config.expect("the defaults"))
    }

    fn at_rest(micros: u64) -> ImuSample {
        ImuSample { timestamp: Timestamp::from_micros(micros), ..ImuSample::default() }
    }

    /// Feeds a gravity-free foot at rest for `samples` ms, starting at 0.
    fn rested(samples: u64) -> HalfWidthEstimator<64> {
        let mut estimator = estimator(GRAVITY_FREE);
        for ms in 0..samples {
            estimator.update(&at_rest(ms * 1000), None);
        }
        estimator
    }

    #[test]
    fn presets_are_valid_at_their_rates() {
        for (preset, rate) in [
            (HalfWidthParams::DEFAULT, 1_000.0),
            (HalfWidthParams::PAPER, 1_000.0),
            (HalfWidthParams::PAPER_GO1, 250.0),
        ] {
            let stream = Stream::new(rate, Gravity::Included).expect("a rate");
            let config = preset.validate::<256>(&Params::DEFAULT, stream);
            assert_eq!(config.map(|config| config.window_length()), Ok(50));
        }
    }

    #[test]
    fn window_length_is_its_duration_times_the_sample_rate() {
        let stream = Stream::new(200.0, Gravity::Included).expect("a rate");
        let config = HalfWidthParams::DEFAULT.validate::<256>(&Params::DEFAULT, stream);
        assert_eq!(config.map(|config| config.window_length()), Ok(10));
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
            let params = HalfWidthParams { window, ..HalfWidthParams::DEFAULT };
            let error = params.validate::<256>(&Params::DEFAULT, GRAVITY_FREE).unwrap_err();
            let is_named = match error {
                ParamsError::OutOfRange { field, .. } => field == "window",
                ParamsError::WindowLength { capacity, .. } => capacity == 256,
                ParamsError::UnknownConstant => false,
            };
            assert!(is_named, "{window:?}: {error}");
        }
    }

    #[test]
    fn number_of_either_group_out_of_range_is_rejected_by_name() {
        let mut params = Params::DEFAULT;
        params.decision.threshold = 1.0;
        let mut half_widths = HalfWidthParams::DEFAULT;
        half_widths.half_width.ay = 10.1;
        for (params, half_widths, expected) in [
            (params, HalfWidthParams::DEFAULT, "decision.threshold"),
            (Params::DEFAULT, half_widths, "half_width.acceleration_m_s2.ay"),
        ] {
            let error = half_widths.validate::<64>(&params, GRAVITY_FREE).unwrap_err();
            let ParamsError::OutOfRange { field, .. } = error else {
                panic!("{error}");
            };
            assert_eq!(field, expected);
        }
    }

    #[test]
    fn foot_at_rest_is_stable_after_window_and_on_delay() {
        let mut estimator = estimator(GRAVITY_FREE);
        let decisions: Vec<_> =
            (0..100).map(|ms| estimator.update(&at_rest(ms * 1000), None).decision).collect();
        let first = decisions.iter().position(|d| *d == Decision::Stable);
        // The window is full with its last sample; the decision follows 20 ms later.
        assert_eq!(first, Some(50 - 1 + 20));
    }

    #[test]
    fn foot_that_stands_has_no_flag() {
        assert_eq!(rested(100).update(&at_rest(100_000), None).flags, Flags::NONE);
    }

    #[test]
    fn doubtful_samples_have_probability_zero_and_count_as_mass_zero() {
        let mut estimator = rested(60);
        let sample = ImuSample { validity: Validity::Stale, ..at_rest(60_000) };
        assert_eq!(estimator.update(&sample, None).probabilities, Probabilities::default());
        let axis = estimator.update(&at_rest(61_000), None).probabilities.axes.ax;
        assert!((axis - 49.0 / 50.0).abs() < 1.0e-6, "{axis}");
    }

    #[test]
    fn missing_samples_count_as_mass_zero() {
        let estimate = rested(60).update(&at_rest(59_000 + 4_000), None);
        let axis = estimate.probabilities.axes.ax;
        assert!((axis - 47.0 / 50.0).abs() < 1.0e-6, "{axis}");
    }

    #[test]
    fn gap_as_long_as_the_window_empties_it() {
        let estimate = rested(60).update(&at_rest(59_000 + 50_000), None);
        let expected = Flags::NONE.with(Flag::TimeGap).with(Flag::WindowNotFull);
        assert_eq!(estimate.flags, expected);
    }

    #[test]
    fn slow_slide_is_not_detected() {
        let mut estimator = estimator(GRAVITY_FREE);
        for ms in 0..700 {
            // The foot reaches 15 mm/s after 100 ms, and becomes faster.
            let push = if ms >= 600 { 0.15 } else { 0.0 };
            let sample = ImuSample {
                specific_force: SpecificForce(Vec3::new(0.0, push, 0.0)),
                ..at_rest(ms * 1000)
            };
            let estimate = estimator.update(&sample, None);
            assert!(ms < 400 || estimate.decision == Decision::Stable, "{ms}");
        }
    }

    #[test]
    fn clock_set_back_costs_one_sample() {
        let mut estimator = rested(60);
        let flags = [5_000, 6_000, 7_000].map(|t| estimator.update(&at_rest(t), None).flags);
        let invalid = Flags::NONE.with(Flag::InvalidSample);
        assert_eq!(flags, [invalid, Flags::NONE, Flags::NONE]);
    }

    #[test]
    fn probability_is_zero_until_up_is_known() {
        let sample = ImuSample {
            specific_force: SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY)),
            ..at_rest(0)
        };
        let estimate = estimator(Stream::KILOHERTZ).update(&sample, None);
        assert!(estimate.flags.contains(Flag::AttitudeNotInitialised));
        assert_eq!(estimate.probabilities.stable, 0.0);
        assert_eq!(estimate.decision, Decision::NotStable);
    }
}
