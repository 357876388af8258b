//! State of an estimator in the caller's memory.

use estimator_core::{ContactEstimator, Load};

use crate::error::Error;
use crate::types::{CEstimate, CLearnt, CParams, CSample};

/// Largest size of an [`Estimator`], bytes: `FOOTFALL_ESTIMATOR_SIZE` of the header.
pub const SIZE: usize = 1024;

/// Mark of memory that holds an estimator: "FOFT" in little-endian memory.
pub(crate) const READY: u32 = 0x5446_4F46;

/// An estimator, with a mark that distinguishes it from other memory.
#[derive(Debug)]
#[repr(C)]
pub struct Estimator {
    pub(crate) ready: u32,
    core: ContactEstimator<1>,
}

const _: () = assert!(size_of::<Estimator>() <= SIZE && align_of::<Estimator>() <= 8);

impl Estimator {
    /// An estimator without samples.
    ///
    /// # Errors
    /// A parameter is out of its range.
    pub fn new(params: &CParams) -> Result<Self, Error> {
        let config = params.checked()?.validate().map_err(|_| Error::Learnt)?;
        Ok(Self { ready: READY, core: ContactEstimator::new(&config) })
    }

    /// Processes the next sample, and the load if it is known.
    ///
    /// # Errors
    /// The validity of the sample is not one of the constants; the estimator has not changed.
    pub fn update(&mut self, sample: &CSample, load: Option<f32>) -> Result<CEstimate, Error> {
        let estimate = self.core.update(&sample.checked()?, load.map(Load));
        Ok((&estimate).into())
    }

    /// State learnt so far.
    #[must_use]
    pub fn learnt(&self) -> CLearnt {
        CLearnt { values: self.core.learnt().to_array() }
    }
}
