//! State of an estimator in the caller's memory.

use core::mem::MaybeUninit;

use estimator_core::clock::{Bridge, Bridged};
use estimator_core::gravity::GravityCheck;
use estimator_core::{
    Config, ContactEstimate, ContactEstimator, Flag, Flags, ImuSample, Load, Stream, Timestamp,
};

use crate::error::Error;
use crate::types::{CEstimate, CLearnt, CParams, CSample};

/// Largest size of an [`Estimator`], bytes: `FOOTFALL_ESTIMATOR_SIZE` of the header.
pub const SIZE: usize = 1536;

/// Most samples of a batch: `FOOTFALL_MOST_SAMPLES` of the header.
pub const MOST_SAMPLES: usize = 4096;

/// Mark of memory that holds an estimator: "FOFT" in little-endian memory.
pub(crate) const READY: u32 = 0x5446_4F46;

/// An estimator, with a mark that distinguishes it from other memory. It holds no pointer, so that its bytes may be moved.
#[derive(Debug)]
#[repr(C)]
pub struct Estimator {
    pub(crate) ready: u32,
    pub(crate) core: ContactEstimator,
    pub(crate) before: Before,
}

/// Steps between the caller's samples and the estimator.
#[derive(Debug)]
pub(crate) struct Before {
    bridge: Bridge,
    gravity: GravityCheck,
}

impl Before {
    /// Steps for the samples of a stream.
    pub(crate) fn new(stream: Stream) -> Self {
        Self { bridge: Bridge::new(stream), gravity: GravityCheck::new(stream) }
    }
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
    /// Processes the next sample, and the load if it is known, and writes the estimate.
    ///
    /// # Errors
    /// The validity of the sample is not one of the constants; the estimator and the estimate have not changed.
    pub fn update(
        &mut self,
        sample: &CSample,
        load: Option<f32>,
        to: &mut CEstimate,
    ) -> Result<(), Error> {
        let mut imu = sample.checked()?;
        let is_in_doubt = self.prepare(&mut imu);
        let estimate = self.core.update(&imu, load.map(Load));
        self.write(&estimate, is_in_doubt, to);
        to.timestamp_us = sample.timestamp_us;
        Ok(())
    }

    /// Gives a sample its time for the estimator, and returns whether this time is in doubt. A function of its own, so
    /// that it leaves the stack before the estimate is computed.
    #[inline(never)]
    fn prepare(&mut self, imu: &mut ImuSample) -> bool {
        self.before.gravity.push(imu);
        let Bridged { timestamp, is_in_doubt } = self.before.bridge.next(imu.timestamp);
        imu.timestamp = timestamp;
        is_in_doubt
    }

    /// Writes the estimate as in the header, without its time. A function of its own, as above.
    #[inline(never)]
    fn write(&self, estimate: &ContactEstimate, is_in_doubt: bool, to: &mut CEstimate) {
        let mut converted = CEstimate::from(estimate);
        if is_in_doubt {
            converted = CEstimate {
                flags: converted.flags | u32::from(Flags::NONE.with(Flag::InvalidSample).bits()),
                orientation: converted.orientation,
                gyro_bias_rad_s: converted.gyro_bias_rad_s,
                ..CEstimate::doubtful()
            };
        }
        converted.flags |= self.faults(converted.flags);
        *to = converted;
    }

    /// Flags of samples that are not what the parameters say. The unit is compared only while the foot is in doubt, which a
    /// wrong one does not end.
    fn faults(&self, flags: u32) -> u32 {
        let mut faults = 0;
        if flags != 0 && self.core.implausible_force().is_some() {
            faults |= CEstimate::UNIT;
        }
        if self.before.gravity.is_gravity_left() {
            faults |= CEstimate::GRAVITY;
        }
        faults
    }

    /// Spreads the times of samples that were read at once, the last of which has the time of the newest.
    pub fn spread_timestamps(&self, samples: &mut [CSample]) {
        let newest_us = samples.last().map_or(0, |newest| newest.timestamp_us);
        let newest = self.before.bridge.presumed(Timestamp::from_micros(newest_us));
        let times = self.core.batch_timestamps(newest, samples.len());
        for (sample, time) in samples.iter_mut().zip(times) {
            let earlier_us = newest.micros_since(time).unwrap_or(0);
            sample.timestamp_us = newest_us.saturating_sub(earlier_us);
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
