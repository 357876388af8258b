//! Check that the estimator computes the same bits here as elsewhere.
//!
//! A stimulus computed only from integers drives the estimator through rest, motion, impacts, saturation,
//! readings that are not numbers, stale samples and gaps in time; a digest covers every bit of
//! every estimate, and at intervals the learnt values. Two machines that print the same digests
//! agree on all of these.

use crate::any::{AnyEstimator, AnyParams};
use crate::params::STANDARD_GRAVITY;
use crate::vector::{Quaternion, Vec3};
use crate::{
    AngularRate, ContactEstimate, Gravity, ImuSample, Learnt, Load, ParamsError, Saturation,
    SpecificForce, Stream, Timestamp, Validity,
};

/// Presets that are run, with their names and streams: one for each estimator.
pub const PRESETS: [(&str, AnyParams, Stream); 2] = [
    ("default", AnyParams::DEFAULT, Stream::KILOHERTZ),
    ("paper", AnyParams::PAPER, Stream::KILOHERTZ.with_gravity(Gravity::Removed)),
];

/// Samples per run: enough to cover every kind of input many times.
pub const SAMPLES: u32 = 20_000;

/// Samples from one digest to the next, so that a difference can be located.
pub const CHECKPOINT: u32 = 2_000;

/// Samples of a hop in the air, and on the ground.
const HOP: u32 = 60;

/// Runs the estimator with `params` over the stimulus and hands the digest so far to `report` at
/// every checkpoint, with the number of samples taken in.
///
/// # Errors
/// The parameters are invalid.
pub fn run(
    params: &AnyParams,
    stream: Stream,
    mut report: impl FnMut(u32, u64),
) -> Result<(), ParamsError> {
    // With the capacity of the firmware.
    let mut estimator = AnyEstimator::<256>::new(&params.validate(stream)?);
    let mut stimulus = Stimulus::new();
    let mut digest = Digest::new();
    for taken in 1..=SAMPLES {
        let (sample, load) = stimulus.next();
        digest.add_estimate(&estimator.update(&sample, load));
        if taken % CHECKPOINT == 0 {
            digest.add_learnt(&estimator.learnt());
            report(taken, digest.value());
        }
    }
    Ok(())
}

/// Kind of a stretch of the stimulus.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stretch {
    /// At rest with a few counts of noise.
    Rest,
    /// A smooth random walk over the whole range.
    Motion,
    /// Landings that no stance follows.
    Hops,
    /// Large jumps, many of them to the end of the range.
    Impacts,
    /// NaN readings, or readings beyond the range of any sensor.
    Garbage,
    /// Stale samples, gaps and steps back in time.
    BrokenTime,
}

impl Stretch {
    /// Rest comes often enough for the attitude filter to align, and once for long enough to
    /// learn the gyroscope's bias.
    const ORDER: [Self; 10] = [
        Self::Rest,
        Self::Rest,
        Self::Rest,
        Self::Rest,
        Self::Motion,
        Self::Hops,
        Self::Impacts,
        Self::Rest,
        Self::Garbage,
        Self::BrokenTime,
    ];
    const SAMPLES: u32 = 625;

    fn at(sample: u32) -> Self {
        let stretch = (sample / Self::SAMPLES) as usize % Self::ORDER.len();
        Self::ORDER.get(stretch).copied().unwrap_or(Self::Rest)
    }
}

/// Sensor codes from a generator of integers, in the scale of an LSM6DSOX at ±16 g and ±2000 °/s.
struct Stimulus {
    random: u32,
    index: u32,
    time_us: u64,
    codes: [i32; 6],
}

impl Stimulus {
    /// m/s² per count at ±16 g.
    const FORCE_PER_COUNT: f32 = 0.488e-3 * STANDARD_GRAVITY;
    /// rad/s per count at ±2000 °/s.
    const RATE_PER_COUNT: f32 = 70.0e-3 * (core::f32::consts::PI / 180.0);
    /// Codes at rest of a sensor that is slightly tilted and has a gyro bias.
    const REST: [i32; 6] = [120, -75, 2045, 5, -3, 2];

    fn new() -> Self {
        Self { random: 0x2545_F491, index: 0, time_us: 0, codes: Self::REST }
    }

    fn next(&mut self) -> (ImuSample, Option<Load>) {
        let stretch = Stretch::at(self.index);
        let mut validity = Validity::Valid;
        let mut elapsed_us = 1_000;
        match stretch {
            Stretch::Rest | Stretch::Garbage => self.set_around_rest(8),
            Stretch::Motion => {
                for axis in 0..6 {
                    self.walk(axis, 700);
                }
            }
            Stretch::Hops => self.set_around_rest(match self.index / HOP % 2 {
                0 => 30_000,
                _ => 1_500,
            }),
            Stretch::Impacts => {
                self.set_around_rest(60_000);
                if self.codes.iter().any(|code| code.abs() >= 32_767) {
                    validity = Validity::Saturated(Saturation::Both);
                }
            }
            Stretch::BrokenTime => {
                self.set_around_rest(30);
                match self.draw(8) {
                    0 => validity = Validity::Stale,
                    1 => elapsed_us = 7_000,
                    2 => elapsed_us = 90_000,
                    3 => elapsed_us = 0,
                    _ => elapsed_us = 985 + u64::from(self.draw(30).unsigned_abs()),
                }
            }
        }
        self.time_us += elapsed_us;
        self.index += 1;
        let [ax, ay, az, wx, wy, wz] = self.codes.map(|code| code as f32);
        let mut sample = ImuSample {
            timestamp: Timestamp::from_micros(self.time_us),
            specific_force: SpecificForce(Vec3::new(ax, ay, az) * Self::FORCE_PER_COUNT),
            angular_rate: AngularRate(Vec3::new(wx, wy, wz) * Self::RATE_PER_COUNT),
            validity,
        };
        if stretch == Stretch::Garbage {
            self.spoil(&mut sample);
        }
        let load = match self.draw(16) {
            0 => None,
            1 => Some(Load(f32::NAN)),
            pressed => Some(Load(pressed as f32)),
        };
        (sample, load)
    }

    fn spoil(&mut self, sample: &mut ImuSample) {
        match self.draw(8) {
            0 => sample.specific_force.0.x = f32::NAN,
            1 => sample.angular_rate.0.z = f32::INFINITY,
            2 => sample.specific_force.0.y = 3.0e38,
            3 => sample.angular_rate.0.x = f32::MIN_POSITIVE / 2.0,
            4 => sample.validity = Validity::Invalid,
            _ => {}
        }
    }

    /// Sets every axis to its rest value plus up to ±`spread`, inside the sensor's range.
    fn set_around_rest(&mut self, spread: u32) {
        for (axis, rest) in Self::REST.into_iter().enumerate() {
            let offset = self.draw(2 * spread + 1) - spread as i32;
            self.set(axis, rest + offset);
        }
    }

    fn walk(&mut self, axis: usize, step: u32) {
        let from = self.codes.get(axis).copied().unwrap_or(0);
        let offset = self.draw(2 * step + 1) - step as i32;
        self.set(axis, from + offset);
    }

    fn set(&mut self, axis: usize, code: i32) {
        if let Some(slot) = self.codes.get_mut(axis) {
            *slot = code.clamp(-32_768, 32_767);
        }
    }

    /// Draws a number from 0 to `below` − 1 (Marsaglia's xorshift32).
    fn draw(&mut self, below: u32) -> i32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        (self.random % below) as i32
    }
}

/// FNV-1a over 32-bit words.
struct Digest(u64);

impl Digest {
    const fn new() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }

    const fn value(&self) -> u64 {
        self.0
    }

    fn add_word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    fn add_vector(&mut self, vector: Vec3) {
        for component in [vector.x, vector.y, vector.z] {
            self.add_word(component.to_bits());
        }
    }

    fn add_learnt(&mut self, learnt: &Learnt) {
        for number in learnt.to_array() {
            self.add_word(number.to_bits());
        }
    }

    fn add_estimate(&mut self, estimate: &ContactEstimate) {
        let ContactEstimate {
            timestamp,
            probabilities,
            decision,
            phase,
            flags,
            orientation,
            linear_acceleration,
            angular_rate,
            gyro_bias,
            velocity_sigma,
        } = *estimate;
        self.add_word(timestamp.as_micros() as u32);
        self.add_word(u32::from(flags.bits()) << 16 | (decision as u32) << 8 | phase as u32);
        for axis in probabilities.axes.to_array() {
            self.add_word(axis.to_bits());
        }
        self.add_vector(Vec3::new(
            probabilities.tangential,
            probabilities.vertical,
            probabilities.stable,
        ));
        let Quaternion { w, x, y, z } = orientation;
        self.add_word(w.to_bits());
        self.add_vector(Vec3::new(x, y, z));
        self.add_vector(linear_acceleration.0);
        self.add_vector(angular_rate.0);
        self.add_vector(gyro_bias.0);
        self.add_word(velocity_sigma.0.to_bits());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    use crate::any::Method;
    use crate::{ContactEstimator, Flag, Learning, Params, Phase};

    #[test]
    fn the_stimulus_covers_all_flags_phases_and_learning() {
        let config = Params::DEFAULT.validate().expect("a preset");
        let mut estimator = ContactEstimator::new(&config, Stream::KILOHERTZ);
        let mut stimulus = Stimulus::new();
        let estimates: Vec<_> = (0..SAMPLES)
            .map(|_| {
                let (sample, load) = stimulus.next();
                estimator.update(&sample, load)
            })
            .collect();
        for flag in Flag::ALL {
            assert!(estimates.iter().any(|e| e.flags.contains(flag)), "{flag:?}");
        }
        for phase in Phase::ALL {
            assert!(estimates.iter().any(|e| e.phase == phase), "{phase:?}");
        }
        let learnt = |e: &ContactEstimate| e.gyro_bias.0 != Vec3::ZERO;
        assert!(estimates.iter().any(learnt), "no bias was learnt");
        // Enough is learnt, and doubted after a landing without a stance.
        let settled = |e: &ContactEstimate| !e.flags.contains(Flag::Settling);
        let changes = estimates.windows(2).map(|pair| [settled(&pair[0]), settled(&pair[1])]);
        assert!(changes.clone().any(|change| change == [false, true]));
        assert!(changes.clone().any(|change| change == [true, false]));
    }

    #[test]
    fn the_presets_cover_both_methods_and_the_first_learns() {
        let [learns, is_set] = PRESETS.map(|(_, params, _)| params);
        assert_eq!(learns.method, Method::SelfCalibrating);
        assert_eq!(learns.params.learning, Learning::On);
        assert_eq!(is_set.method, Method::HalfWidths);
    }

    // A commit that changes the pinned bits on purpose gives the reason.
    #[test]
    fn both_methods_give_the_pinned_bits() {
        const PINNED: [u64; 2] = [0x46ca_4f02_6388_6b23, 0x6ba6_06cf_4478_245b];
        for ((name, params, stream), pinned) in PRESETS.into_iter().zip(PINNED) {
            let mut digests = Vec::new();
            run(&params, stream, |taken, digest| digests.push((taken, digest))).expect("a preset");
            assert!(digests.is_sorted_by_key(|(taken, _)| *taken));
            assert_eq!(digests.len(), (SAMPLES / CHECKPOINT) as usize);
            let (_, found) = digests[digests.len() - 1];
            assert_eq!(found, pinned, "{name}: {found:#018x} for {pinned:#018x}");
        }
    }

    #[test]
    fn one_bit_of_the_learnt_values_changes_the_digest() {
        let digest = |learnt: &Learnt| {
            let mut digest = Digest::new();
            digest.add_learnt(learnt);
            digest.value()
        };
        let other = Learnt { speed: f32::from_bits(1), ..Learnt::default() };
        assert_ne!(digest(&Learnt::default()), digest(&other));
    }

    #[test]
    fn one_bit_in_one_estimate_changes_the_digest() {
        let estimate = ContactEstimate::default();
        let mut other = estimate;
        other.probabilities.axes.wy = f32::from_bits(1);
        let digest = |estimate: &ContactEstimate| {
            let mut digest = Digest::new();
            digest.add_estimate(estimate);
            digest.value()
        };
        assert_ne!(digest(&estimate), digest(&other));
    }
}
