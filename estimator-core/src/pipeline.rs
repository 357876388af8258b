//! Steps that all estimators share: the time, the attitude and the motion before a sample is judged, and decision, phase
//! and velocity afterwards.

use crate::attitude::{Alignment, AttitudeFilter};
use crate::config::Config;
use crate::estimate::{ContactEstimate, Probabilities};
use crate::flags::{Flag, Flags};
use crate::offset::{CERTAIN_STANCE, ForceOffset};
use crate::phase::{Load, PhaseTracker};
use crate::roll::Roll;
use crate::sample::{
    AngularRate, ImuSample, LinearAcceleration, SpecificForce, Timestamp, Validity,
};
use crate::stream::{Gravity, Stream, period_s};
use crate::vector::Vec3;
use crate::velocity::{VelocityCoefficients, VelocitySigma};

/// State of the steps that all estimators share.
#[derive(Clone, Debug)]
pub(crate) struct Pipeline {
    gravity: Gravity,
    /// Nominal time between samples, µs.
    period_us: u64,
    /// Least time between two samples with one missing between them, µs.
    gap_us: u64,
    force_offset: ForceOffset,
    pub(crate) attitude: AttitudeFilter,
    roll: Roll,
    phase: PhaseTracker,
    velocity: VelocityCoefficients,
    pub(crate) velocity_sigma: VelocitySigma,
    /// Time of the previous sample.
    previous: Option<Timestamp>,
}

/// A sample, as an estimator judges it.
pub(crate) struct Reading {
    timestamp: Timestamp,
    /// Samples missing before this one.
    pub(crate) missing: u64,
    /// What is known of the motion, for the judgement.
    pub(crate) motion: Motion,
    /// Motion also of a saturated sample; `None` if it is unknown.
    measured: Option<(LinearAcceleration, AngularRate)>,
    /// Reasons for doubt so far.
    pub(crate) flags: Flags,
}

/// Motion of a sample, as far as it is known.
#[derive(Clone, Copy)]
pub(crate) enum Motion {
    /// The motion, without gravity and bias.
    Known(LinearAcceleration, AngularRate),
    /// The motion is unknown, since up is.
    NoAttitude,
    /// The motion is unknown, since the sample is unreliable.
    Unreliable,
}

/// Time between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Elapsed {
    /// Duration in µs, at least 1.
    Micros(u64),
    /// The clock stood still or was set back.
    Backwards,
}

impl Pipeline {
    /// The state before the first sample.
    #[cfg_attr(feature = "small-stack", inline(never))]
    pub(crate) fn new(config: &Config, stream: Stream) -> Self {
        let period_us = stream.period_us();
        Self {
            gravity: stream.gravity(),
            period_us,
            gap_us: 2 * period_us - period_us / 4,
            force_offset: ForceOffset::NONE,
            attitude: AttitudeFilter::new(config.attitude(stream)),
            roll: config.roll(stream),
            phase: PhaseTracker::new(config.phase()),
            velocity: config.velocity(),
            velocity_sigma: VelocitySigma::MOST,
            previous: None,
        }
    }

    /// Reads the next sample: checks its time and values, and removes gravity and bias.
    #[inline]
    pub(crate) fn read(&mut self, sample: &ImuSample) -> Reading {
        let elapsed = self.elapsed_us(sample.timestamp);
        let validity = match elapsed {
            Elapsed::Micros(_) => sample.checked_validity(),
            Elapsed::Backwards => Validity::Invalid,
        };
        let mut flags = match validity {
            Validity::Valid => Flags::NONE,
            Validity::Saturated(_) => Flags::NONE.with(Flag::Saturated),
            Validity::Stale => Flags::NONE.with(Flag::Stale),
            Validity::Invalid => Flags::NONE.with(Flag::InvalidSample),
        };
        let missing = self.missing_samples(elapsed);
        if missing > 0 {
            flags = flags.with(Flag::TimeGap);
        }
        let specific_force = SpecificForce(self.force_offset.removed_from(sample.specific_force.0));
        let measured = self.measured_motion(&ImuSample { validity, specific_force, ..*sample });
        let motion = match (measured, validity) {
            (Some((acceleration, rate)), Validity::Valid) => Motion::Known(acceleration, rate),
            _ if self.alignment() == Alignment::Searching => {
                flags = flags.with(Flag::AttitudeNotInitialised);
                Motion::NoAttitude
            }
            _ => Motion::Unreliable,
        };
        Reading { timestamp: sample.timestamp, missing, motion, measured, flags }
    }

    /// Learns the offset of the accelerometer, and lets the gyroscope's bias be learnt, from a sample of a foot that
    /// stands with this probability. If gravity was removed from the samples, there is nothing to learn.
    pub(crate) fn learn_in_stance(&mut self, reading: &Reading, probability: f32) {
        if self.gravity == Gravity::Removed {
            return;
        }
        let stands = probability > CERTAIN_STANCE && !reading.flags.are_doubt();
        self.attitude.set_stands(stands);
        if let (true, Motion::Known(acceleration, _)) = (stands, reading.motion) {
            self.force_offset.learn(acceleration.0, period_s(self.period_us));
        }
    }

    /// Decides on a sample with these probabilities. `mean_acceleration` is the length of the mean acceleration over a few
    /// samples, m/s², by which a foot that rolls is known.
    #[inline]
    pub(crate) fn conclude(
        &mut self,
        reading: &Reading,
        probabilities: Probabilities,
        mean_acceleration: f32,
        load: Option<Load>,
    ) -> ContactEstimate {
        let flags = reading.flags;
        // An invalid sample has probability 0, but the means over the window still hold valid samples before it.
        let probabilities = match reading.motion {
            Motion::Known(..) => probabilities,
            Motion::NoAttitude | Motion::Unreliable => Probabilities::default(),
        };
        let (linear_acceleration, angular_rate) = reading.measured.unwrap_or_default();
        if reading.measured.is_some() {
            let certain = if flags.are_doubt() { 0.0 } else { probabilities.stable };
            self.roll.push(angular_rate.0.length(), certain);
        }
        // A robot may not lean on a foot that rolls, so the decision is that for P = 0.
        let rolls = self.roll.rolls(mean_acceleration);
        let firm = if rolls { 0.0 } else { probabilities.stable };
        let (decision, phase) = self.phase.update(reading.timestamp, firm, flags, load);
        self.velocity_sigma = self.velocity.sigma(probabilities.stable, angular_rate.0, flags);
        ContactEstimate {
            timestamp: reading.timestamp,
            probabilities,
            decision,
            phase,
            flags,
            orientation: self.attitude.orientation(),
            linear_acceleration,
            angular_rate,
            gyro_bias: self.attitude.gyro_bias(),
            velocity_sigma: self.velocity_sigma,
        }
    }

    /// Probability above which the foot may be stable.
    pub(crate) const fn threshold(&self) -> f32 {
        self.phase.threshold()
    }

    /// Up in the frame of the foot, if it is estimated; `None` if gravity was removed, so that up is z.
    pub(crate) fn estimated_up(&self) -> Option<Vec3> {
        match self.gravity {
            Gravity::Included => Some(self.attitude.orientation().up()),
            Gravity::Removed => None,
        }
    }

    /// Times of samples that were read at once: see
    /// [`ContactEstimator::batch_timestamps`](crate::ContactEstimator::batch_timestamps).
    pub(crate) fn batch_timestamps(
        &self,
        newest: Timestamp,
        count: usize,
    ) -> impl ExactSizeIterator<Item = Timestamp> + DoubleEndedIterator + use<> {
        // In 32 bits, which a microcontroller can divide. A batch longer than an hour counts as one with a gap.
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let divisor = count.max(1);
        let period = u32::try_from(self.period_us).unwrap_or(u32::MAX);
        let elapsed = self.previous.and_then(|previous| newest.micros_since(previous));
        let elapsed = elapsed.and_then(|elapsed| u32::try_from(elapsed).ok());
        // A read may last a quarter longer than `count` periods, by its jitter and the error of the sensor's clock.
        let periods = u64::from(divisor) + u64::from(count / 4);
        let longest = (periods - 1) * self.period_us + self.gap_us;
        let step = match elapsed {
            Some(elapsed) if elapsed > 0 && u64::from(elapsed) < longest => elapsed / divisor,
            _ => period,
        };
        let newest = newest.as_micros();
        (0..count as usize).map(move |place| {
            let later = u64::from(count) - 1 - place as u64;
            Timestamp::from_micros(newest.saturating_sub(later * u64::from(step)))
        })
    }

    /// Time since the previous sample; one period for the first sample.
    fn elapsed_us(&mut self, now: Timestamp) -> Elapsed {
        // The timestamp is stored even if it is the earlier one, so that a clock that was set back costs
        // one sample and not all that follow.
        match self.previous.replace(now) {
            None => Elapsed::Micros(self.period_us),
            Some(previous) => match now.micros_since(previous) {
                None | Some(0) => Elapsed::Backwards,
                Some(elapsed) => Elapsed::Micros(elapsed),
            },
        }
    }

    /// Number of samples missing in between. Jitter of up to three quarters of a period does not count as one.
    fn missing_samples(&self, elapsed: Elapsed) -> u64 {
        match elapsed {
            Elapsed::Micros(elapsed) if elapsed >= self.gap_us => {
                // In 32 bits, because a time beyond their 71 minutes makes no difference.
                let short = |micros: u64| u32::try_from(micros).unwrap_or(u32::MAX);
                let elapsed = short(elapsed.saturating_add(self.period_us / 4));
                u64::from((elapsed / short(self.period_us).max(1)).saturating_sub(1))
            }
            // The usual case costs no division.
            _ => 0,
        }
    }

    /// Motion after gravity and bias are removed, also of a saturated sample; `None` if it is unknown.
    fn measured_motion(&mut self, sample: &ImuSample) -> Option<(LinearAcceleration, AngularRate)> {
        if self.gravity == Gravity::Included {
            self.attitude.update_checked(sample);
        }
        let is_measured = matches!(sample.validity, Validity::Valid | Validity::Saturated(_));
        if !is_measured || self.alignment() == Alignment::Searching {
            return None;
        }
        let force = sample.specific_force.0;
        Some(match self.gravity {
            Gravity::Removed => (LinearAcceleration(force), sample.angular_rate),
            Gravity::Included => {
                let gravity = self.attitude.orientation().up() * self.attitude.gravity();
                let bias = self.attitude.gyro_bias();
                (LinearAcceleration(force - gravity), AngularRate(sample.angular_rate.0 - bias.0))
            }
        })
    }

    /// Returns how well up is known. It need not be once gravity is removed.
    fn alignment(&self) -> Alignment {
        match self.gravity {
            Gravity::Removed => Alignment::Aligned,
            Gravity::Included => self.attitude.alignment(),
        }
    }
}
