//! Modified recordings: lost samples, jitter, biases, earlier motion of the foot.

use std::f32::consts::PI;

use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Validity, Vec3};
use samples::{RecordedSample, Recording};

/// Bias of the gyroscope after a minute of drift, rad/s: 0.05 °/s/K over 40 K.
const DRIFT: f32 = 2.0 * PI / 180.0;

/// Unit vectors along x, y and z.
pub const AXES: [Vec3; 3] =
    [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

/// Noise of a sensor at rest, m/s² and rad/s: about that of an LSM6DSOX.
const NOISE: (f32, f32) = (0.02, 0.0012);

/// Number of samples from whose mean a foot that [`stood`] takes its orientation.
const FIRST: usize = 30;

/// A xorshift generator: the same numbers from the same seed on every machine.
#[derive(Clone, Debug)]
pub struct Chance(u64);

impl Chance {
    /// Creates a generator; a seed of 0 counts as 1.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        // Multiply, because a small seed would give small numbers at first.
        Self(seed.max(1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Returns a uniformly distributed number in [0, 1).
    pub fn even(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns an approximately Gaussian number with a standard deviation of 1.
    pub fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }

    /// Returns three Gaussian components with this standard deviation.
    pub fn vector(&mut self, deviation: f32) -> Vec3 {
        let [x, y, z] = [(); 3].map(|()| deviation * self.gaussian() as f32);
        Vec3::new(x, y, z)
    }
}

/// Removes a share of the samples, each independently.
#[must_use]
pub fn losing_single(recording: &Recording, share: f64, seed: u64) -> Recording {
    let mut chance = Chance::new(seed);
    let mut changed = recording.clone();
    changed.samples.retain(|_| chance.even() >= share);
    changed
}

/// Removes a share of the samples in bursts of `length`.
#[must_use]
pub fn losing_bursts(recording: &Recording, share: f64, length: u32, seed: u64) -> Recording {
    let mut chance = Chance::new(seed);
    let mut changed = recording.clone();
    let begins = share / f64::from(length) / (1.0 - share);
    let mut left = 0;
    changed.samples.retain(|_| {
        if left == 0 && chance.even() < begins {
            left = length;
        }
        let kept = left == 0;
        left -= u32::from(!kept);
        kept
    });
    changed
}

/// Removes the samples of the last `gap` s of each period of `every` s, after the first second.
#[must_use]
pub fn with_gaps(recording: &Recording, every: f64, gap: f64) -> Recording {
    let mut changed = recording.clone();
    let start = recording.samples.first().map_or(0.0, RecordedSample::time_s);
    changed.samples.retain(|sample| {
        let time = sample.time_s() - start;
        time < 1.0 || time % every < every - gap
    });
    changed
}

/// Moves times by up to a share of the period, without a change of order.
#[must_use]
pub fn jittering(recording: &Recording, share: f64, seed: u64) -> Recording {
    let mut chance = Chance::new(seed);
    let period = 1.0e6 / f64::from(recording.sample_rate);
    let mut previous = 0;
    changed(recording, |sample| {
        let jitter = (2.0 * chance.even() - 1.0) * share * period;
        let micros = (sample.imu.timestamp.as_micros() as f64 + jitter) as u64;
        previous = micros.max(previous + 1);
        sample.imu.timestamp = Timestamp::from_micros(previous);
    })
}

/// Adds a bias to the accelerometer, m/s².
#[must_use]
pub fn with_force_bias(recording: &Recording, bias: Vec3) -> Recording {
    changed(recording, |sample| sample.imu.specific_force.0 += bias)
}

/// Adds a bias to the gyroscope, rad/s.
#[must_use]
pub fn with_rate_bias(recording: &Recording, bias: Vec3) -> Recording {
    changed(recording, |sample| sample.imu.angular_rate.0 += bias)
}

/// Lets the gyroscope's bias about x, about y and about z grow from 5 s on, by 2 °/s in a minute.
#[must_use]
pub fn with_rate_drifts(recording: &Recording) -> [Recording; 3] {
    AXES.map(|axis| {
        changed(recording, |sample| {
            let share = ((sample.time_s() as f32 - 5.0) / 60.0).clamp(0.0, 1.0);
            sample.imu.angular_rate.0 += axis * (share * DRIFT);
        })
    })
}

/// Applies a change to every sample.
#[must_use]
pub fn changed(recording: &Recording, change: impl FnMut(&mut RecordedSample)) -> Recording {
    let mut changed = recording.clone();
    changed.samples.iter_mut().for_each(change);
    changed
}

/// Prepends a number of seconds of standing still, in the pose at the start of the recording, without labels.
#[must_use]
pub fn stood(recording: &Recording, seconds: f64, seed: u64) -> Recording {
    let mut chance = Chance::new(seed);
    let first = &recording.samples[..FIRST.min(recording.samples.len())];
    let share = 1.0 / first.len() as f32;
    let (mut force, mut rate) = (Vec3::ZERO, Vec3::ZERO);
    if recording.gravity == Gravity::Included {
        for sample in first {
            force += sample.imu.specific_force.0 * share;
            rate += sample.imu.angular_rate.0 * share;
        }
    }
    let samples = (seconds * f64::from(recording.sample_rate)) as usize;
    let standing =
        (0..samples).map(|_| (force + chance.vector(NOISE.0), rate + chance.vector(NOISE.1)));
    after(standing, recording)
}

/// Prepends samples of a foot that measured these specific forces and angular rates, without load and label.
#[must_use]
pub fn after(motions: impl IntoIterator<Item = (Vec3, Vec3)>, recording: &Recording) -> Recording {
    let valid = |(force, rate)| ImuSample {
        specific_force: SpecificForce(force),
        angular_rate: AngularRate(rate),
        validity: Validity::Valid,
        ..ImuSample::default()
    };
    after_samples(motions.into_iter().map(valid), recording)
}

/// Prepends samples of any validity; their times are set.
#[must_use]
pub fn after_samples(
    before: impl IntoIterator<Item = ImuSample>,
    recording: &Recording,
) -> Recording {
    let period = (1.0e6 / f64::from(recording.sample_rate)).round() as u64;
    let before = (0..).zip(before).map(|(k, imu)| RecordedSample {
        imu: ImuSample { timestamp: Timestamp::from_micros(k * period), ..imu },
        load: None,
        label: None,
    });
    let mut samples: Vec<RecordedSample> = before.collect();
    let start = samples.len() as u64 * period;
    samples.extend(recording.samples.iter().map(|sample| {
        let mut later = *sample;
        let micros = start + sample.imu.timestamp.as_micros();
        later.imu.timestamp = Timestamp::from_micros(micros);
        later
    }));
    Recording { samples, ..recording.clone() }
}
