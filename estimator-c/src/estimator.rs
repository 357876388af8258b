//! State of an estimator in the caller's memory.

use core::mem::MaybeUninit;

use estimator_core::clock::Bridge;
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
    /// Orientation and bias of the newest estimate.
    orientation: [f32; 4],
    gyro_bias_rad_s: [f32; 3],
}

impl Before {
    /// Steps for the samples of a stream.
    pub(crate) fn new(stream: Stream) -> Self {
        let CEstimate { orientation, gyro_bias_rad_s, .. } = CEstimate::doubtful();
        let (bridge, gravity) = (Bridge::new(stream), GravityCheck::new(stream));
        Self { bridge, gravity, orientation, gyro_bias_rad_s }
    }
}

const _: () = assert!(size_of::<Estimator>() <= SIZE && align_of::<Estimator>() <= 8);

/// Configuration of checked parameters. This is a function of its own, so that the parameters leave the stack before
/// the estimator is made.
#[inline(never)]
pub(crate) fn config(params: &CParams) -> Result<(Config, Stream), Error> {
    let (params, stream) = params.checked()?;
    Ok((params.validate().map_err(|_| Error::Learnt)?, stream))
}

/// Makes an estimator in its place. This is a function of its own, so that it does not share the stack with the checks.
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
    /// The validity of the sample is not one of the constants. In this case the estimator and the estimate do not change.
    pub fn update(
        &mut self,
        sample: &CSample,
        load: Option<f32>,
        to: &mut CEstimate,
    ) -> Result<(), Error> {
        let mut imu = sample.checked()?;
        if self.prepare(&mut imu) {
            let estimate = self.core.update(&imu, load.map(Load));
            self.write(&estimate, to);
        } else {
            self.write_doubt(to);
        }
        to.timestamp_us = sample.timestamp_us;
        Ok(())
    }

    /// Gives a sample its time for the estimator, and returns whether it has one. This is a function of its own, so
    /// that its variables leave the stack before the estimate is computed.
    #[inline(never)]
    fn prepare(&mut self, imu: &mut ImuSample) -> bool {
        self.before.gravity.push(imu);
        let time = self.before.bridge.next(imu.timestamp);
        imu.timestamp = time.unwrap_or(imu.timestamp);
        time.is_some()
    }

    /// Writes the estimate as in the header, without its time. This is a function of its own, as above.
    #[inline(never)]
    fn write(&mut self, estimate: &ContactEstimate, to: &mut CEstimate) {
        *to = CEstimate::from(estimate);
        to.flags |= self.faults(to.flags);
        self.before.orientation = to.orientation;
        self.before.gyro_bias_rad_s = to.gyro_bias_rad_s;
    }

    /// Writes the estimate of a sample whose time is in doubt, which the estimator does not get.
    #[inline(never)]
    fn write_doubt(&self, to: &mut CEstimate) {
        let flags = u32::from(Flags::NONE.with(Flag::InvalidSample).bits());
        *to = CEstimate {
            flags: flags | self.faults(flags),
            orientation: self.before.orientation,
            gyro_bias_rad_s: self.before.gyro_bias_rad_s,
            ..CEstimate::doubtful()
        };
    }

    /// Flags of samples that contradict the parameters. The unit is checked only while another flag is set, because a
    /// wrong unit keeps the foot in doubt.
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

    /// Spreads the times of samples that were read at once, the last of which has the time of the newest. They are the next
    /// samples of [`update`](Self::update).
    pub fn spread_timestamps(&mut self, samples: &mut [CSample]) {
        let newest_us = samples.last().map_or(0, |newest| newest.timestamp_us);
        self.begin_read(samples.len());
        let times = self.times_of_read(newest_us, samples.len());
        for (sample, time_us) in samples.iter_mut().zip(times) {
            sample.timestamp_us = time_us;
        }
    }

    /// Announces that the next samples were read at once.
    pub fn begin_read(&mut self, count: usize) {
        self.before.bridge.begin_read(u32::try_from(count).unwrap_or(u32::MAX));
    }

    /// Times of the samples of a read, oldest first, the last of which has the time of the newest; µs.
    pub fn times_of_read(
        &self,
        newest_us: u64,
        count: usize,
    ) -> impl ExactSizeIterator<Item = u64> + use<> {
        let due = u32::try_from(count).unwrap_or(u32::MAX);
        let newest = self.before.bridge.presumed(Timestamp::from_micros(newest_us), due);
        self.core.batch_timestamps(newest, count).map(move |time| {
            let earlier_us = newest.micros_since(time).unwrap_or(0);
            newest_us.wrapping_sub(earlier_us)
        })
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
