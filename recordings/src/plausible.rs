//! What a recording cannot be, by its numbers: wrong units, gravity that is there or not, a sensor
//! on its side, times that jump, too few samples.
//!
//! | finding | it is reported where |
//! |---|---|
//! | acceleration in g, or in m/s² read as g | \|a\| at rest is 1 m/s² or 9.8² m/s², within a fifth |
//! | rates in °/s | one sample in a hundred is beyond [`LARGEST_RATE`] |
//! | gravity is there or not | \|a\| at rest is not what was declared |
//! | gravity is not along z | its mean at rest is more than 45° from the z axis |
//! | the clock jumps | steps of more than a second that are no usual steps of the recording |
//! | rows arrive in batches | a third of the steps are less than a quarter of the mean |
//! | the rate is low | it is below [`LOWEST_RATE`] |
//!
//! Rest is where the accelerations are quietest: a tenth of the recording, in pieces of a tenth of a
//! second. So a foot that never rests may have findings that are wrong, and none is an error of its
//! own.

use std::fmt;

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Gravity, Validity};

use crate::recording::{RecordedSample, Recording};

/// The end of the range that gyroscopes on robots have, 2000 °/s, rad/s.
pub const LARGEST_RATE: f32 = 34.9;

/// The lowest rate of the recordings that the estimator was chosen with, Hz.
pub const LOWEST_RATE: f32 = 100.0;

/// A measured rate may be below [`LOWEST_RATE`] by this, as a fraction.
const RATE_TOLERANCE: f32 = 0.01;

/// How long a piece is that is quiet as a whole, s.
const PIECE_S: f32 = 0.1;

/// The share of the pieces that counts as rest.
const REST_SHARE: f64 = 0.1;

/// How far |a| at rest may be from what it should be, as a factor.
const NEAR: f32 = 1.2;

/// Below this, there is no gravity in |a| at rest, m/s².
const NO_GRAVITY: f32 = 0.5;

/// From this step on the clock jumps, s, where it is also [`UNUSUAL`].
const JUMP_S: f64 = 1.0;

/// How many times the median step a step is that is not usual.
const UNUSUAL: f64 = 20.0;

/// One thing that is not plausible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// Accelerations look like g, but are read as m/s².
    AccelerationInG {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Accelerations look like m/s², but are read as g.
    AccelerationNotInG {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Angular rates look like °/s, but are read as rad/s.
    RateInDegrees {
        /// Which one sample in a hundred exceeds, rad/s.
        percentile: f32,
    },
    /// Gravity is declared removed, but is there.
    GravityIncluded {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Gravity is declared included, but is not there.
    GravityRemoved {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// At rest, gravity is not along the z axis of the sensor.
    GravityNotAlongZ {
        /// The axis that is up, such as `-x`.
        up: &'static str,
    },
    /// The clock jumps.
    ClockJumps {
        /// How often.
        count: usize,
        /// The longest step, s.
        longest_s: f64,
    },
    /// Rows arrive in batches.
    Batches {
        /// The share of steps that are much shorter than the mean, in [0, 1].
        share: f64,
    },
    /// There are few samples in a window.
    LowRate {
        /// The sample rate, Hz.
        rate: f32,
    },
}

impl Finding {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::AccelerationInG { .. } => "acceleration_in_g",
            Self::AccelerationNotInG { .. } => "acceleration_not_in_g",
            Self::RateInDegrees { .. } => "rate_in_degrees",
            Self::GravityIncluded { .. } => "gravity_included",
            Self::GravityRemoved { .. } => "gravity_removed",
            Self::GravityNotAlongZ { .. } => "gravity_not_along_z",
            Self::ClockJumps { .. } => "clock_jumps",
            Self::Batches { .. } => "batches",
            Self::LowRate { .. } => "low_rate",
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AccelerationInG { at_rest } => write!(
                f,
                "the acceleration is {at_rest:.2} m/s² at rest, which looks like g: --units g"
            ),
            Self::AccelerationNotInG { at_rest } => write!(
                f,
                "the acceleration is {at_rest:.0} m/s² at rest, so it was in m/s² already: --units m/s2"
            ),
            Self::RateInDegrees { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like °/s: --units dps"
            ),
            Self::GravityIncluded { at_rest } => write!(
                f,
                "gravity is declared removed, but the acceleration is {at_rest:.2} m/s² at rest: --gravity included"
            ),
            Self::GravityRemoved { at_rest } => write!(
                f,
                "gravity is declared included, but the acceleration is {at_rest:.2} m/s² at rest: --gravity removed"
            ),
            Self::GravityNotAlongZ { up } => write!(
                f,
                "{up} is up at rest, not z: p_tangential and p_vertical take z for up, so map the axes (--map)"
            ),
            Self::ClockJumps { count, longest_s } => write!(
                f,
                "the clock jumps {}, by up to {longest_s:.1} s: samples are missing, or --times rate",
                if *count == 1 {
                    "once".to_owned()
                } else {
                    format!("{count} times")
                }
            ),
            Self::Batches { share } => write!(
                f,
                "{:.0} % of the rows come right after another, as if they arrive in batches: --times rate",
                100.0 * share
            ),
            Self::LowRate { rate } => write!(
                f,
                "{rate} Hz is too low for the windows of the estimate, which was chosen with {LOWEST_RATE} Hz and more"
            ),
        }
    }
}

/// All that is not plausible about a recording.
#[must_use]
pub fn check(recording: &Recording) -> Vec<Finding> {
    let mut findings = Vec::new();
    if let Some(rest) = rest(recording) {
        findings.extend(check_gravity(&rest, recording.gravity));
    }
    let percentile = percentile_of_rate(&recording.samples);
    if percentile > LARGEST_RATE {
        findings.push(Finding::RateInDegrees { percentile });
    }
    findings.extend(check_clock(&recording.samples));
    if recording.sample_rate < LOWEST_RATE * (1.0 - RATE_TOLERANCE) {
        findings.push(Finding::LowRate {
            rate: recording.sample_rate,
        });
    }
    findings
}

/// What the accelerometer reads at rest.
struct Rest {
    /// The median of |a|, m/s².
    size: f32,
    /// The mean, m/s².
    mean: [f32; 3],
}

/// Rest, where enough samples are valid to say.
fn rest(recording: &Recording) -> Option<Rest> {
    let length = (recording.sample_rate * PIECE_S).max(5.0) as usize;
    let mut pieces: Vec<(f32, [f32; 3])> = recording
        .samples
        .chunks_exact(length)
        .filter_map(piece)
        .collect();
    let count = ((pieces.len() as f64 * REST_SHARE).ceil() as usize).min(pieces.len());
    pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let quiet = &pieces[..count];
    let mut sizes: Vec<f32> = quiet.iter().map(|(_, mean)| size(*mean)).collect();
    sizes.sort_by(f32::total_cmp);
    let mean = |axis: usize| {
        let sum: f32 = quiet.iter().map(|(_, mean)| mean[axis]).sum();
        sum / count as f32
    };
    Some(Rest {
        size: *sizes.get(count / 2)?,
        mean: [mean(0), mean(1), mean(2)],
    })
}

/// The variance of the accelerations in a piece, and their mean; `None` where one is no number or
/// not to be believed.
fn piece(samples: &[RecordedSample]) -> Option<(f32, [f32; 3])> {
    let (mut sums, mut squares) = ([0.0_f64; 3], 0.0_f64);
    for sample in samples {
        if sample.imu.checked_validity() != Validity::Valid {
            return None;
        }
        let force = sample.imu.specific_force.0;
        for (sum, value) in sums.iter_mut().zip([force.x, force.y, force.z]) {
            *sum += f64::from(value);
            squares += f64::from(value) * f64::from(value);
        }
    }
    let mean = sums.map(|sum| sum / samples.len() as f64);
    let squared_mean: f64 = mean.iter().map(|value| value * value).sum();
    let variance = squares / samples.len() as f64 - squared_mean;
    Some((variance.max(0.0) as f32, mean.map(|value| value as f32)))
}

fn size([x, y, z]: [f32; 3]) -> f32 {
    libm::sqrtf(x * x + y * y + z * z)
}

fn is_near(value: f32, expected: f32) -> bool {
    (expected / NEAR..=expected * NEAR).contains(&value)
}

/// What is wrong with the acceleration at rest.
fn check_gravity(rest: &Rest, gravity: Gravity) -> Option<Finding> {
    let at_rest = rest.size;
    let has_gravity = is_near(at_rest, STANDARD_GRAVITY);
    if is_near(at_rest, 1.0) {
        return Some(Finding::AccelerationInG { at_rest });
    }
    if is_near(at_rest, STANDARD_GRAVITY * STANDARD_GRAVITY) {
        return Some(Finding::AccelerationNotInG { at_rest });
    }
    match gravity {
        Gravity::Removed => has_gravity.then_some(Finding::GravityIncluded { at_rest }),
        Gravity::Included if at_rest < NO_GRAVITY => Some(Finding::GravityRemoved { at_rest }),
        Gravity::Included if has_gravity => {
            check_up(rest.mean).map(|up| Finding::GravityNotAlongZ { up })
        }
        Gravity::Included => None,
    }
}

/// The axis that is up, where it is not z: the accelerometer of a still sensor reads upwards.
fn check_up(mean: [f32; 3]) -> Option<&'static str> {
    let [x, y, z] = mean;
    if z > size(mean) * std::f32::consts::FRAC_1_SQRT_2 {
        return None;
    }
    let largest = x.abs().max(y.abs()).max(z.abs());
    Some(if x.abs() == largest {
        if x > 0.0 { "x" } else { "-x" }
    } else if y.abs() == largest {
        if y > 0.0 { "y" } else { "-y" }
    } else if z > 0.0 {
        // More than 45° from each axis.
        "a slanted direction"
    } else {
        "-z"
    })
}

/// Which one sample in a hundred exceeds, by the largest of the three axes, rad/s; 0 where there is
/// none.
fn percentile_of_rate(samples: &[RecordedSample]) -> f32 {
    let mut rates: Vec<f32> = samples
        .iter()
        .map(|sample| sample.imu.angular_rate.0)
        .map(|rate| rate.x.abs().max(rate.y.abs()).max(rate.z.abs()))
        .filter(|rate| rate.is_finite())
        .collect();
    let index = rates.len() * 99 / 100;
    if index >= rates.len() {
        return 0.0;
    }
    *rates.select_nth_unstable_by(index, f32::total_cmp).1
}

/// What is wrong with the times.
fn check_clock(samples: &[RecordedSample]) -> Vec<Finding> {
    let mut steps: Vec<f64> = samples
        .windows(2)
        .map(|pair| pair[1].time_s() - pair[0].time_s())
        .collect();
    if steps.is_empty() {
        return Vec::new();
    }
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut findings = Vec::new();
    let jumps = steps
        .iter()
        .filter(|step| **step > JUMP_S && **step > UNUSUAL * median);
    let count = jumps.clone().count();
    if count > 0 {
        let longest_s = jumps.fold(0.0, |longest: f64, step| longest.max(*step));
        findings.push(Finding::ClockJumps { count, longest_s });
    }
    let short = steps.iter().filter(|step| **step < 0.25 * mean).count();
    let share = short as f64 / steps.len() as f64;
    if share > 1.0 / 3.0 && count == 0 {
        findings.push(Finding::Batches { share });
    }
    findings
}

#[cfg(test)]
mod tests;
