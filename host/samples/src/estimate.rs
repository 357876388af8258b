//! The estimator applied to a recording, sample by sample or to one in memory.

use estimator_core::any::{AnyEstimator, AnyParams};
use estimator_core::{
    AngularRate, ContactEstimate, Gravity, Learnt, ParamsError, Stream, Timestamp,
};

use crate::{RecordedSample, Recording};

/// Longest window of a replay, in samples: four seconds at 1 kHz, far more than contact needs, for comparisons.
/// The estimator then takes about 100 KB.
const CAPACITY: usize = 4096;

/// Checks parameters for the samples of a stream.
///
/// # Errors
/// A parameter is out of its range; the window may have up to 4096 samples.
pub fn check(params: &AnyParams, stream: Stream) -> Result<(), ParamsError> {
    params.validate::<CAPACITY>(stream).map(|_| ())
}

/// The estimator for the samples of one recording.
#[derive(Clone)]
pub struct Estimator(Box<AnyEstimator<CAPACITY>>);

impl Estimator {
    /// Creates the estimator for a recording at `sample_rate` in Hz.
    ///
    /// # Errors
    /// The rate or a parameter is out of its range; the window may have up to 4096 samples.
    pub fn new(
        sample_rate: f32,
        gravity: Gravity,
        params: &AnyParams,
    ) -> Result<Self, ParamsError> {
        let stream = Stream::new(sample_rate, gravity)?;
        Ok(Self(Box::new(AnyEstimator::new(&params.validate(stream)?))))
    }

    /// Returns the estimate of the next sample.
    pub fn update(&mut self, sample: &RecordedSample) -> ContactEstimate {
        self.0.update(&sample.imu, sample.load)
    }

    /// Times of `count` samples that were read at once, oldest first, the last at `newest`.
    pub fn batch_timestamps(
        &self,
        newest: Timestamp,
        count: usize,
    ) -> impl ExactSizeIterator<Item = Timestamp> {
        self.0.batch_timestamps(newest, count)
    }

    /// Gyroscope bias at the newest sample, rad/s; `None` until the foot has been at rest.
    #[must_use]
    pub fn gyro_bias(&self) -> Option<AngularRate> {
        self.0.gyro_bias()
    }

    /// Mean size of the force in the last half second, m/s², if no foot can have it, because it is in another unit; `None`
    /// if it is plausible, or not known yet.
    #[must_use]
    pub fn implausible_force(&self) -> Option<f32> {
        self.0.implausible_force()
    }

    /// Returns the parameters learnt from all samples.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.0.learnt()
    }
}

/// Runs the estimator over a recording: one estimate per sample, in order.
///
/// # Errors
/// The errors of [`Estimator::new`].
pub fn estimates_of(
    recording: &Recording,
    params: &AnyParams,
) -> Result<Vec<ContactEstimate>, ParamsError> {
    Ok(estimates_and_learnt(recording, params, || ())?.0)
}

/// As [`estimates_of`], and returns what was learnt by the end of the recording. `after_each` is called after each
/// sample, e.g. to show progress.
///
/// # Errors
/// The errors of [`estimates_of`].
pub fn estimates_and_learnt(
    recording: &Recording,
    params: &AnyParams,
    mut after_each: impl FnMut(),
) -> Result<(Vec<ContactEstimate>, Learnt), ParamsError> {
    let mut estimator = Estimator::new(recording.sample_rate, recording.gravity, params)?;
    let estimates = recording
        .samples
        .iter()
        .map(|sample| {
            let estimate = estimator.update(sample);
            after_each();
            estimate
        })
        .collect();
    Ok((estimates, estimator.learnt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::any::Method;
    use estimator_core::{Flag, ImuSample, Timestamp};

    fn still_foot(sample_rate: f32) -> Recording {
        let period_us = (1.0e6 / sample_rate) as u64;
        Recording {
            name: "still".to_owned(),
            sample_rate,
            gravity: Gravity::Removed,
            load_title: String::new(),
            samples: (0..100)
                .map(|k| RecordedSample {
                    imu: ImuSample {
                        timestamp: Timestamp::from_micros(k * period_us),
                        ..ImuSample::default()
                    },
                    load: None,
                    label: None,
                })
                .collect(),
        }
    }

    #[test]
    fn every_sample_has_an_estimate() {
        let recording = still_foot(500.0);
        let estimates = estimates_of(&recording, &AnyParams::DEFAULT).unwrap();
        let times = estimates.iter().map(|e| e.timestamp);
        assert!(times.eq(recording.samples.iter().map(|s| s.imu.timestamp)));
    }

    #[test]
    fn window_keeps_its_duration_at_the_recordings_rate() {
        let params = AnyParams { method: Method::HalfWidths, ..AnyParams::DEFAULT };
        let estimates = estimates_of(&still_foot(200.0), &params).unwrap();
        let full = estimates.iter().position(|e| !e.flags.contains(Flag::WindowNotFull));
        assert_eq!(full, Some(9), "50 ms at 200 Hz are 10 samples");
    }
}
