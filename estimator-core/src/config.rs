//! Checked parameters, in the form from which an estimator is made.

use crate::attitude::{AttitudeCoefficients, AttitudeFilter};
use crate::learnt::Learnt;
use crate::math::rounded;
use crate::parameter;
use crate::params::Params;
use crate::phase::PhaseCoefficients;
use crate::range::ParamsError;
use crate::roll::Roll;
use crate::self_calibrating::SelfCalibratingConfig;
use crate::stream::Stream;
use crate::velocity::VelocityCoefficients;

impl Params {
    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range; NaN is out of every
    /// range.
    pub fn validate(&self) -> Result<Config, ParamsError> {
        self.check()?;
        Ok(Config { params: *self })
    }

    /// Checks every field as [`Self::validate`] does.
    ///
    /// # Errors
    /// As those of [`Self::validate`].
    pub fn check(&self) -> Result<(), ParamsError> {
        parameter::check(self)
    }
}

/// Checked parameters. Only [`Params::validate`] creates them.
#[derive(Clone, Debug)]
pub struct Config {
    /// Derived values are computed where they are kept, so that a start needs little stack.
    params: Params,
}

impl Config {
    /// Attitude filter for these samples, for use without an estimator.
    #[doc(hidden)]
    #[must_use]
    pub fn attitude_filter(&self, stream: Stream) -> AttitudeFilter {
        AttitudeFilter::new(self.attitude(stream))
    }

    pub(crate) const fn self_calibrating(&self, stream: Stream) -> SelfCalibratingConfig<'_> {
        let Params { constants, learning, learnt, .. } = &self.params;
        SelfCalibratingConfig::new(constants, *learning, *learnt, stream.sample_rate())
    }

    /// State that an estimator starts from, in the ranges in which it can be stored.
    pub(crate) fn learnt(&self) -> Learnt {
        let Params { constants, learnt, .. } = &self.params;
        let learnt = learnt.unwrap_or_else(|| Learnt::unobserved(constants));
        learnt.at_start(constants).limited()
    }

    pub(crate) fn attitude(&self, stream: Stream) -> AttitudeCoefficients {
        AttitudeCoefficients::new(&self.params.attitude, stream.sample_rate())
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

    pub(crate) fn roll(&self, stream: Stream) -> Roll {
        Roll::new(stream.period_us(), &self.params.velocity)
    }

    pub(crate) const fn velocity(&self) -> VelocityCoefficients {
        VelocityCoefficients::new(&self.params.velocity)
    }
}

/// Microseconds of a duration in s.
fn micros(seconds: f32) -> u64 {
    u64::from(rounded(seconds * 1.0e6))
}
