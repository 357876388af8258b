//! Plausibility checks of a recording's values: wrong units, gravity included or removed, a sensor on its side,
//! clock jumps, too few samples. [`FINDINGS`] has what is found.
//!
//! Rest is the tenth of the recording with the quietest accelerations, in pieces of 0.1 s. The findings about a
//! foot that never rests may be wrong, and no finding is an error by itself.

mod clock;
mod dead;
mod held;
mod histogram;
mod rates;
mod rest;

use crate::samples::recording::{RecordedSample, Recording};
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Gravity, Mounting, Vec3};
use thiserror::Error;

use crate::config::axes_text;
use crate::mounting;
use clock::ClockCheck;
use dead::DeadCheck;
use held::HeldCheck;
use rates::RateCheck;
use rest::{Rest, RestSearch};

pub use rates::LARGEST_RATE;

/// Value of |a| at rest from which it cannot be gravity, whatever the motion of a foot at its quietest, m/s².
pub const LARGEST_REST: f32 = 3.0 * STANDARD_GRAVITY;

/// Share of samples that may be non-numbers without a finding.
const NOT_NUMBERS_SHARE: f64 = 0.01;

/// Lowest rate of the recordings with which the estimator was chosen, Hz.
pub const LOWEST_RATE: f32 = 100.0;

/// Tolerance of a measured rate below [`LOWEST_RATE`], as a fraction.
const RATE_TOLERANCE: f32 = 0.01;

/// Tolerance of |a| at rest, as a factor.
const NEAR: f32 = 1.2;

/// Value of |a| at rest below which it contains no gravity, m/s².
const NO_GRAVITY: f32 = 0.5;

/// One implausible property of a recording.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Finding {
    /// Accelerations look like g, but are read as m/s².
    #[error("the acceleration is {at_rest:.2} m/s² at rest, which looks like g: --units g")]
    AccelerationInG {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Accelerations are in an unsupported unit, or of another full scale.
    #[error(
        "the acceleration is {at_rest:.*} m/s² at rest, {:.*} times gravity, so it is in another unit or of another full scale: --units m/s2, g or mg, or --scale with the value of a count",
        decimals(*at_rest), decimals(*at_rest), at_rest / STANDARD_GRAVITY
    )]
    AccelerationInOtherUnit {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Samples have an axis that is not a number.
    #[error(
        "{samples} of {of} samples have an axis that is blank or no number, and are invalid: where accelerations and rates have rows of their own, join these first (pandas.merge_asof)"
    )]
    NotNumbers {
        /// Number of such samples.
        samples: u64,
        /// Number of all samples.
        of: u64,
    },
    /// Angular rates look like °/s, but are read as rad/s.
    #[error(
        "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like °/s: --units dps"
    )]
    RateInDegrees {
        /// Rate exceeded by one sample in a hundred, rad/s.
        percentile: f32,
    },
    /// The angular rate stays the same while the acceleration changes.
    #[error(
        "the angular rate is the same in each sample for {longest_s:.1} s, though the acceleration changes: the gyroscope is off, dead, or not recorded"
    )]
    DeadGyroscope {
        /// Longest such time, s.
        longest_s: f64,
    },
    /// Gravity is declared removed, but is included.
    #[error(
        "gravity is declared removed, but the acceleration is {at_rest:.2} m/s² at rest: --gravity included"
    )]
    GravityIncluded {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Gravity is declared included, but is missing.
    #[error(
        "gravity is declared included, but the acceleration is {at_rest:.2} m/s² at rest: --gravity removed"
    )]
    GravityRemoved {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// At rest, gravity is not along the z axis.
    #[error("{up} is up at rest, where the foot has z: --axes {}", axes_text(axes))]
    GravityNotAlongZ {
        /// The axis that is up, such as `-x`.
        up: &'static str,
        /// The mounting that would make z up.
        axes: Mounting,
    },
    /// The clock jumps.
    #[error(
        "the clock jumps {}, by up to {longest_s:.1} s: samples are missing, or --times rate",
        times(*count)
    )]
    ClockJumps {
        /// Number of jumps.
        count: usize,
        /// The longest step, s.
        longest_s: f64,
    },
    /// Rows arrive in batches.
    #[error(
        "{:.0} % of the rows come right after another, as if they arrive in batches: --times rate",
        100.0 * share
    )]
    Batches {
        /// The share of steps that are much shorter than the mean, in [0, 1].
        share: f64,
    },
    /// Rows come more often than new readings of the sensor.
    #[error(
        "{samples} of {of} samples repeat the one before in all axes: the sensor was read at about {rate:.0} Hz, and its readings were held"
    )]
    HeldReadings {
        /// Number of samples that repeat the one before.
        samples: u64,
        /// Number of all samples.
        of: u64,
        /// The rate of new readings, Hz.
        rate: f32,
    },
    /// A window has few samples.
    #[error(
        "{rate} Hz is too low for the windows of the estimate, which was chosen with {LOWEST_RATE} Hz and more"
    )]
    LowRate {
        /// The sample rate, Hz.
        rate: f32,
    },
}

/// Names of all findings, with their conditions.
pub const FINDINGS: [(&str, &str); 12] = [
    ("acceleration_in_g", "the acceleration at rest is 1 m/s², within a fifth"),
    (
        "acceleration_in_other_unit",
        "the acceleration at rest is steady and not gravity, or above 29 m/s²",
    ),
    ("not_numbers", "more than one sample in a hundred has an axis that is blank or no number"),
    ("rate_in_degrees", "one sample in a hundred is beyond 34.9 rad/s"),
    (
        "dead_gyroscope",
        "the angular rate stays the same for a second, though the acceleration changes",
    ),
    ("gravity_included", "gravity is declared removed, but the acceleration at rest has it"),
    ("gravity_removed", "gravity is declared included, but the acceleration at rest is near 0"),
    ("gravity_not_along_z", "z is more than 45° from up at rest"),
    ("clock_jumps", "steps of more than a second that are unusual in the recording"),
    ("batches", "a third of the steps are shorter than a quarter of the mean"),
    ("held_readings", "one reading in four repeats the one before it, to the last bit"),
    ("low_rate", "the sample rate is below 100 Hz"),
];

impl Finding {
    /// Name of the finding, for programs.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::AccelerationInG { .. } => "acceleration_in_g",
            Self::AccelerationInOtherUnit { .. } => "acceleration_in_other_unit",
            Self::NotNumbers { .. } => "not_numbers",
            Self::RateInDegrees { .. } => "rate_in_degrees",
            Self::DeadGyroscope { .. } => "dead_gyroscope",
            Self::GravityIncluded { .. } => "gravity_included",
            Self::GravityRemoved { .. } => "gravity_removed",
            Self::GravityNotAlongZ { .. } => "gravity_not_along_z",
            Self::ClockJumps { .. } => "clock_jumps",
            Self::Batches { .. } => "batches",
            Self::HeldReadings { .. } => "held_readings",
            Self::LowRate { .. } => "low_rate",
        }
    }

    /// The same finding for a recording to which `mounting` was already applied: the suggested mounting replaces
    /// that one.
    #[must_use]
    pub fn with_mounting(self, mounting: &Mounting) -> Self {
        match self {
            Self::GravityNotAlongZ { up, axes } => {
                Self::GravityNotAlongZ { up, axes: mounting::then(mounting, &axes) }
            }
            other => other,
        }
    }
}

fn times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        count => format!("{count} times"),
    }
}

/// Returns the findings about a recording in SI units.
#[must_use]
pub fn check(recording: &Recording) -> Vec<Finding> {
    let mut check = Check::new(recording.sample_rate, recording.gravity);
    for sample in &recording.samples {
        check.add(sample);
    }
    check.findings()
}

/// Checks a recording sample by sample; memory grows by a thousandth of its length.
pub struct Check {
    sample_rate: f32,
    gravity: Gravity,
    samples: u64,
    not_numbers: u64,
    rest: RestSearch,
    rates: RateCheck,
    dead: DeadCheck,
    clock: ClockCheck,
    held: HeldCheck,
}

impl Check {
    /// Checks a recording at `sample_rate` in Hz, with its gravity as declared.
    #[must_use]
    pub fn new(sample_rate: f32, gravity: Gravity) -> Self {
        Self {
            sample_rate,
            gravity,
            samples: 0,
            not_numbers: 0,
            rest: RestSearch::new(sample_rate),
            rates: RateCheck::default(),
            dead: DeadCheck::default(),
            clock: ClockCheck::default(),
            held: HeldCheck::default(),
        }
    }

    /// Processes the next sample.
    pub fn add(&mut self, sample: &RecordedSample) {
        self.rest.add(sample);
        self.samples += 1;
        let vectors = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        self.not_numbers += u64::from(!vectors.into_iter().all(is_number));
        self.rates.add(sample);
        self.dead.add(sample);
        self.clock.add(sample.imu.timestamp);
        self.held.add(sample);
    }

    /// Returns the findings about all samples.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let rest = self.rest.rest();
        let gravity = rest.and_then(|rest| check_gravity(&rest, self.gravity));
        let mut findings = Vec::from_iter(gravity);
        if self.not_numbers as f64 > NOT_NUMBERS_SHARE * self.samples as f64 {
            findings.push(Finding::NotNumbers { samples: self.not_numbers, of: self.samples });
        }
        findings.extend(self.rates.finding());
        findings.extend(self.dead.finding());
        findings.extend(self.clock.findings());
        findings.extend(self.held.finding(self.sample_rate));
        if self.sample_rate < LOWEST_RATE * (1.0 - RATE_TOLERANCE) {
            findings.push(Finding::LowRate { rate: self.sample_rate });
        }
        findings
    }
}

/// Gravity as read by the accelerometer at rest, m/s²; it points up. `None` if it was removed or if the reading
/// cannot be gravity.
#[must_use]
pub fn gravity_at_rest(recording: &Recording) -> Option<Vec3> {
    let mut search = RestSearch::new(recording.sample_rate);
    for sample in &recording.samples {
        search.add(sample);
    }
    let rest = search.rest()?;
    let is_gravity = recording.gravity == Gravity::Included && has_gravity(&rest);
    is_gravity.then_some(rest.mean)
}

/// Returns whether all components are finite.
const fn is_number(v: Vec3) -> bool {
    v.x.is_finite() && v.y.is_finite() && v.z.is_finite()
}

fn has_gravity(rest: &Rest) -> bool {
    is_near(rest.size, STANDARD_GRAVITY)
}

fn is_near(value: f32, expected: f32) -> bool {
    (expected / NEAR..=expected * NEAR).contains(&value)
}

/// Finding about the acceleration at rest.
fn check_gravity(rest: &Rest, gravity: Gravity) -> Option<Finding> {
    let at_rest = rest.size;
    let has_gravity = has_gravity(rest);
    if is_near(at_rest, 1.0) {
        return Some(Finding::AccelerationInG { at_rest });
    }
    if at_rest > LARGEST_REST {
        return Some(Finding::AccelerationInOtherUnit { at_rest });
    }
    match gravity {
        Gravity::Removed => has_gravity.then_some(Finding::GravityIncluded { at_rest }),
        Gravity::Included if at_rest < NO_GRAVITY => Some(Finding::GravityRemoved { at_rest }),
        Gravity::Included if has_gravity => {
            let up = check_up(rest.mean)?;
            let axes = mounting::with_z_up(rest.mean)?;
            Some(Finding::GravityNotAlongZ { up, axes })
        }
        Gravity::Included => rest.is_steady.then_some(Finding::AccelerationInOtherUnit { at_rest }),
    }
}

/// Decimals with which an acceleration of about that of gravity, or far above it, is written.
fn decimals(at_rest: f32) -> usize {
    if at_rest > LARGEST_REST { 0 } else { 2 }
}

/// The axis that is up, if it is not z; the accelerometer of a still sensor reads upwards.
fn check_up(mean: Vec3) -> Option<&'static str> {
    let Vec3 { x, y, z } = mean;
    if z > rest::size(mean) * std::f32::consts::FRAC_1_SQRT_2 {
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

#[cfg(test)]
mod tests;
