//! State of an estimator in the caller's memory.

use core::mem::MaybeUninit;

use estimator_core::{Config, ContactEstimator, Load, Stream, Timestamp};

use crate::error::Error;
use crate::types::{CEstimate, CLearnt, CParams, CSample};

/// Largest size of an [`Estimator`], bytes: `FOOTFALL_ESTIMATOR_SIZE` of the header.
pub const SIZE: usize = 1024;

/// Most samples of a batch: `FOOTFALL_MOST_SAMPLES` of the header.
pub const MOST_SAMPLES: usize = 4096;

/// Mark of memory that holds an estimator: "FOFT" in little-endian memory.
pub(crate) const READY: u32 = 0x5446_4F46;

/// An estimator, with a mark that distinguishes it from other memory.
#[derive(Debug)]
#[repr(C)]
pub struct Estimator {
    pub(crate) ready: u32,
    pub(crate) core: ContactEstimator,
}

const _: () = assert!(size_of::<Estimator>() <= SIZE && align_of::<Estimator>() <= 8);

/// Configuration of checked parameters. A function of its own, so that they leave the stack before the estimator is made.
#[inline(never)]
pub(crate) fn config(params: &CParams) -> Result<(Config, Stream), Error> {
    let (params, stream) = params.checked()?;
    Ok((params.validate().map_err(|_| Error::Learnt)?, stream))
}

/// Makes an estimator in its place. A function of its own, so that it does not share the stack with the checks.
#[inline(never)]
pub(crate) fn build(
    place: &mut MaybeUninit<ContactEstimator>,
    (config, stream): &(Config, Stream),
) {
    place.write(ContactEstimator::new(config, *stream));
}

impl Estimator {
    /// Processes the next sample, and the load if it is known.
    ///
    /// # Errors
    /// The validity of the sample is not one of the constants; the estimator has not changed.
    pub fn update(&mut self, sample: &CSample, load: Option<f32>) -> Result<CEstimate, Error> {
        let estimate = self.core.update(&sample.checked()?, load.map(Load));
        Ok((&estimate).into())
    }

    /// Spreads the times of samples that were read at once, the last of which has the time of the newest.
    pub fn spread_timestamps(&self, samples: &mut [CSample]) {
        let newest = samples.last().map_or(0, |newest| newest.timestamp_us);
        let times = self.core.batch_timestamps(Timestamp::from_micros(newest), samples.len());
        for (sample, time) in samples.iter_mut().zip(times) {
            sample.timestamp_us = time.as_micros();
        }
    }

    /// Checks the unit of the accelerometer's readings.
    ///
    /// # Errors
    /// The mean force is not that of a foot in m/s².
    pub fn check_unit(&self) -> Result<(), Error> {
        self.core.implausible_force().map_or(Ok(()), |_| Err(Error::Unit))
    }

    /// Mean force of a foot at rest, m/s²; NaN while it is not at rest.
    #[must_use]
    pub fn force_at_rest(&self) -> f32 {
        self.core.force_at_rest().unwrap_or(f32::NAN)
    }

    /// State learnt so far.
    #[must_use]
    pub fn learnt(&self) -> CLearnt {
        (&self.core.learnt()).into()
    }
}
