//! Plausibility checks of a recording's values: wrong units, gravity included or removed, a sensor on its side,
//! a frozen sensor, mirrored or exchanged axes, clock jumps, too few samples. [`FindingKind`] lists the findings.
//!
//! Rest is the tenth of the recording with the quietest accelerations, in pieces of 0.1 s. The findings about a
//! foot that never rests may be wrong, and no finding is an error by itself.

mod handedness;
mod loads;

use std::fmt::{self, Formatter};

use estimator_core::mounting::Mounting;
use estimator_core::params::LoadParams;
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Gravity, Timestamp, Validity, Vec3};

use crate::display_in_plain_words;
use crate::hint::{Hint, InWords, Vocabulary};
use crate::input::rate::{Steps, median};
use crate::input::{AccelerationUnit, RateUnit};
use crate::mounting;
use crate::samples::{RecordedSample, Recording};
use crate::space::components;
use handedness::HandednessCheck;
use loads::LoadCheck;

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// Accelerations look like g, but are read as m/s².
    AccelerationInG {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Accelerations are in an unsupported unit, or of another full scale.
    AccelerationInOtherUnit {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Samples have an axis that is not a number.
    NotNumbers {
        /// Number of such samples.
        samples: u64,
        /// Number of all samples.
        of: u64,
    },
    /// Angular rates look like °/s, but are read as rad/s.
    RateInDegrees {
        /// Rate exceeded by one sample in a hundred, rad/s.
        percentile: f32,
    },
    /// The angular rate stays the same while the acceleration changes.
    DeadGyroscope {
        /// Longest such time, s.
        longest_s: f64,
    },
    /// All six axes stay the same.
    FrozenSensor {
        /// Longest such time, s.
        longest_s: f64,
        /// Its end, s before the end of the recording.
        before_end_s: f64,
    },
    /// The columns of the accelerometer contain angular rates, and those of the gyroscope accelerations.
    ExchangedSensors {
        /// Angular rate at rest as read, rad/s: in truth gravity.
        at_rest: f32,
    },
    /// The axes are a mirror image: gravity turns against the angular rate.
    LeftHanded {
        /// The axis of the sensor that is up at rest, such as `y`.
        up: &'static str,
    },
    /// Gravity is declared removed, but is included.
    GravityIncluded {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// Gravity is declared included, but is missing.
    GravityRemoved {
        /// |a| at rest, m/s².
        at_rest: f32,
    },
    /// At rest, gravity is not along the z axis.
    GravityNotAlongZ {
        /// The axis that is up, such as `-x`.
        up: &'static str,
        /// The mounting that would make z up.
        axes: Mounting,
    },
    /// The load crosses none of its thresholds, or one alone.
    LoadNeverCrosses {
        /// Load in swings, in the unit of the signal.
        low: f32,
        /// Load in stances.
        high: f32,
        /// Upper threshold that it would cross.
        on: f32,
        /// Lower threshold that it would cross.
        off: f32,
    },
    /// The load is negative in stances.
    LoadNegative {
        /// Load in stances, in the unit of the signal.
        lowest: f32,
    },
    /// The clock jumps.
    ClockJumps {
        /// Number of jumps.
        count: usize,
        /// The longest step, s.
        longest_s: f64,
    },
    /// Rows arrive in batches.
    Batches {
        /// The share of steps that are much shorter than the mean, in [0, 1].
        share: f64,
    },
    /// Rows come more often than new readings of the sensor.
    HeldReadings {
        /// Number of samples that repeat the one before.
        samples: u64,
        /// Number of all samples.
        of: u64,
        /// The rate of new readings, Hz.
        rate: f32,
    },
    /// A window has few samples.
    LowRate {
        /// The sample rate, Hz.
        rate: f32,
    },
}

display_in_plain_words!(Finding);

impl InWords for Finding {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        self.write(f)?;
        match self.hint() {
            Some(hint) => {
                f.write_str(": ")?;
                hint.write_in(words, f)
            }
            None => Ok(()),
        }
    }
}

/// Defines the kinds of findings by name and condition.
macro_rules! findings {
    ($($kind:ident = $name:literal, $condition:literal;)+) => {
        crate::named! {
            /// Kind of a finding, by its name for programs.
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub enum FindingKind {
                $(#[doc = $condition] $kind = $name),+
            }
        }

        impl FindingKind {
            /// Condition under which a recording has such a finding.
            #[must_use]
            pub const fn condition(self) -> &'static str {
                match self {
                    $(Self::$kind => $condition),+
                }
            }
        }

        impl Finding {
            /// Kind of the finding.
            #[must_use]
            pub const fn kind(&self) -> FindingKind {
                match self {
                    $(Self::$kind { .. } => FindingKind::$kind),+
                }
            }
        }
    };
}

findings! {
    AccelerationInG = "acceleration_in_g", "the acceleration at rest is 1 m/s², within a fifth";
    AccelerationInOtherUnit = "acceleration_in_other_unit",
        "the acceleration at rest is steady and not gravity, or above 29 m/s²";
    NotNumbers = "not_numbers", "more than one sample in a hundred has an axis that is blank or no number";
    RateInDegrees = "rate_in_degrees", "one sample in a hundred is beyond 34.9 rad/s";
    DeadGyroscope = "dead_gyroscope", "the angular rate stays the same for a second, though the acceleration changes";
    FrozenSensor = "frozen_sensor",
        "all six axes stay the same for two seconds, or for ten if the angular rate is exactly 0";
    ExchangedSensors = "exchanged_sensors",
        "the angular rate at rest is steady and as large as gravity, and the acceleration is near 0";
    LeftHanded = "left_handed", "swings end at rest only if the angular rate is taken with the opposite sign";
    GravityIncluded = "gravity_included", "gravity is declared removed, but the acceleration at rest has it";
    GravityRemoved = "gravity_removed", "gravity is declared included, but the acceleration at rest is near 0";
    GravityNotAlongZ = "gravity_not_along_z", "z is more than 45° from up at rest";
    LoadNeverCrosses = "load_never_crosses",
        "the load has two levels, which are both above or both below its thresholds";
    LoadNegative = "load_negative", "the load has two levels, and that of stances is negative";
    ClockJumps = "clock_jumps", "steps of more than a second that are unusual in the recording";
    Batches = "batches", "a third of the steps are shorter than a quarter of the mean";
    HeldReadings = "held_readings", "one reading in four repeats the one before it, to the last bit";
    LowRate = "low_rate", "the sample rate is below 100 Hz";
}

impl Finding {
    /// Name of the finding, for programs.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.kind().name()
    }

    /// Returns what to do about the finding, where the values show it.
    #[must_use]
    pub fn hint(&self) -> Option<Hint> {
        Some(match self {
            Self::AccelerationInG { .. } => {
                Hint::AccelerationUnit(AccelerationUnit::StandardGravity)
            }
            Self::AccelerationInOtherUnit { .. } => Hint::OtherUnit,
            Self::RateInDegrees { .. } => Hint::RateUnit(RateUnit::DegreesPerSecond),
            Self::GravityIncluded { .. } => Hint::Gravity(Gravity::Included),
            Self::GravityRemoved { .. } => Hint::Gravity(Gravity::Removed),
            Self::GravityNotAlongZ { axes, .. } => Hint::Axes(*axes),
            Self::LoadNeverCrosses { on, off, .. } => Hint::LoadThresholds { on: *on, off: *off },
            Self::ClockJumps { .. } => Hint::MissingSamples,
            Self::Batches { .. } => Hint::SpaceRows,
            Self::ExchangedSensors { .. } => {
                Hint::ExchangeColumns("ax=wx,ay=wy,az=wz,wx=ax,wy=ay,wz=az")
            }
            Self::LeftHanded { up } => match *up {
                "y" => Hint::ExchangeColumns("ay=az,az=ay,wy=wz,wz=wy"),
                "x" => Hint::ExchangeColumns("ax=az,az=ax,wx=wz,wz=wx"),
                _ => Hint::TurnRatesAround,
            },
            Self::LoadNegative { .. } => Hint::TurnLoadAround,
            Self::NotNumbers { .. }
            | Self::FrozenSensor { .. }
            | Self::DeadGyroscope { .. }
            | Self::HeldReadings { .. }
            | Self::LowRate { .. } => return None,
        })
    }

    /// Writes the implausible value and its likely cause.
    fn write(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::AccelerationInG { at_rest } => {
                write!(f, "the acceleration is {at_rest:.2} m/s² at rest, which looks like g")
            }
            Self::AccelerationInOtherUnit { at_rest } => write!(
                f,
                "the acceleration is {at_rest:.digits$} m/s² at rest, {:.digits$} times gravity, so it is in another \
                 unit or of another full scale",
                at_rest / STANDARD_GRAVITY,
                digits = decimals(*at_rest)
            ),
            Self::NotNumbers { samples, of } => write!(
                f,
                "{samples} of {of} samples have an axis that is blank or no number, and are invalid: where accelerations \
                 and rates have rows of their own, join these first (pandas.merge_asof)"
            ),
            Self::RateInDegrees { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like °/s"
            ),
            Self::DeadGyroscope { longest_s } => write!(
                f,
                "the angular rate is the same in each sample for {longest_s:.1} s, though the acceleration changes: the \
                 gyroscope is off, dead, or not recorded"
            ),
            Self::FrozenSensor { longest_s, before_end_s } => {
                write!(f, "all six axes stay the same for {longest_s:.1} s, ")?;
                if *before_end_s < 0.5 {
                    f.write_str("up to the end")?;
                } else {
                    write!(f, "until {before_end_s:.1} s before the end")?;
                }
                f.write_str(
                    ": the sensor or its bus is stuck, and the probability there means nothing",
                )
            }
            Self::ExchangedSensors { at_rest } => write!(
                f,
                "the angular rate is {at_rest:.2} rad/s at rest and the acceleration about 0, as if the columns of \
                 accelerometer and gyroscope were exchanged"
            ),
            Self::LeftHanded { up } => {
                f.write_str("the axes are left-handed: gravity turns against the angular rate")?;
                match *up {
                    "x" | "y" => write!(f, ", and {up} is up, as where {up} and z are exchanged"),
                    _ => Ok(()),
                }
            }
            Self::GravityIncluded { at_rest } => write!(
                f,
                "gravity is declared removed, but the acceleration is {at_rest:.2} m/s² at rest"
            ),
            Self::GravityRemoved { at_rest } => write!(
                f,
                "gravity is declared included, but the acceleration is {at_rest:.2} m/s² at rest"
            ),
            Self::GravityNotAlongZ { up, .. } => {
                write!(f, "{up} is up at rest, where the foot has z")
            }
            Self::LoadNeverCrosses { low, high, .. } => write!(
                f,
                "the load is about {low} in swings and {high} in stances, and does not cross both of its thresholds"
            ),
            Self::LoadNegative { lowest } => write!(
                f,
                "the load is {lowest} in stances, as of a sensor whose z points down (on a foot, set \
                 load_input.scale)"
            ),
            Self::ClockJumps { count, longest_s } => {
                write!(f, "the clock jumps {}, by up to {longest_s:.1} s", times(*count))
            }
            Self::Batches { share } => write!(
                f,
                "{:.0} % of the rows come right after another, as if they arrive in batches",
                100.0 * share
            ),
            Self::HeldReadings { samples, of, rate } => write!(
                f,
                "{samples} of {of} samples repeat the one before in all axes: the sensor was read at about {rate:.0} Hz, \
                 and its readings were held; leave the repeats out"
            ),
            Self::LowRate { rate } => write!(
                f,
                "{rate} Hz is too low for the windows of the estimate, which was chosen with {LOWEST_RATE} Hz and more"
            ),
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
            // The columns are those of the sensor.
            Self::LeftHanded { .. } if *mounting != Mounting::default() => {
                Self::LeftHanded { up: "z" }
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
    check_with(recording, Check::new(recording.sample_rate, recording.gravity))
}

/// Returns the findings about a recording in SI units, and about its loads with these thresholds.
#[must_use]
pub fn check_with_load(recording: &Recording, thresholds: LoadParams) -> Vec<Finding> {
    let check = Check::new(recording.sample_rate, recording.gravity);
    check_with(recording, check.with_thresholds(thresholds))
}

fn check_with(recording: &Recording, mut check: Check) -> Vec<Finding> {
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
    /// The same with the angular rates in the place of the accelerations.
    exchanged: RestSearch,
    handedness: HandednessCheck,
    rates: RateCheck,
    dead: DeadCheck,
    frozen: FrozenCheck,
    clock: ClockCheck,
    held: HeldCheck,
    loads: LoadCheck,
    /// Thresholds of the load, if they are checked.
    thresholds: Option<LoadParams>,
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
            exchanged: RestSearch::new(sample_rate),
            handedness: HandednessCheck::new(sample_rate),
            rates: RateCheck::default(),
            dead: DeadCheck::default(),
            frozen: FrozenCheck::default(),
            clock: ClockCheck::default(),
            held: HeldCheck::default(),
            loads: LoadCheck::default(),
            thresholds: None,
        }
    }

    /// Checks the loads against these thresholds, too.
    #[must_use]
    pub fn with_thresholds(self, thresholds: LoadParams) -> Self {
        Self { thresholds: Some(thresholds), ..self }
    }

    /// Processes the next sample.
    pub fn add(&mut self, sample: &RecordedSample) {
        self.rest.add(sample);
        self.exchanged.add(&with_exchanged_sensors(sample));
        self.handedness.add(sample);
        self.samples += 1;
        let vectors = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        self.not_numbers += u64::from(!vectors.into_iter().all(is_number));
        self.rates.add(sample);
        self.dead.add(sample);
        self.frozen.add(sample);
        self.clock.add(sample.imu.timestamp);
        self.held.add(sample);
        self.loads.add(sample);
    }

    /// Returns the findings about all samples.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let rest = self.rest.rest();
        let mut findings = Vec::from_iter(rest.and_then(|rest| self.check_axes(&rest)));
        if self.not_numbers as f64 > NOT_NUMBERS_SHARE * self.samples as f64 {
            findings.push(Finding::NotNumbers { samples: self.not_numbers, of: self.samples });
        }
        findings.extend(self.rates.finding());
        findings.extend(self.dead.finding());
        findings.extend(self.frozen.finding());
        findings.extend(self.clock.findings());
        findings.extend(self.held.finding(self.sample_rate));
        findings.extend(self.thresholds.and_then(|thresholds| self.loads.finding(&thresholds)));
        if self.sample_rate < LOWEST_RATE * (1.0 - RATE_TOLERANCE) {
            findings.push(Finding::LowRate { rate: self.sample_rate });
        }
        findings
    }
}

impl Check {
    /// Finding about gravity and the axes.
    fn check_axes(&self, rest: &Rest) -> Option<Finding> {
        if let Some(exchanged) = self.exchanged.rest()
            && self.gravity == Gravity::Included
            && rest.size < NO_GRAVITY
            && exchanged.is_steady
            && has_gravity(&exchanged)
        {
            return Some(Finding::ExchangedSensors { at_rest: exchanged.size });
        }
        let found = check_gravity(rest, self.gravity);
        let is_of_axes = matches!(found, None | Some(Finding::GravityNotAlongZ { .. }));
        if is_of_axes && self.gravity == Gravity::Included && self.handedness.is_left_handed() {
            let up = check_up(rest.mean).unwrap_or("z");
            return Some(Finding::LeftHanded { up });
        }
        found
    }
}

fn with_exchanged_sensors(sample: &RecordedSample) -> RecordedSample {
    let mut sample = *sample;
    let imu = &mut sample.imu;
    (imu.specific_force.0, imu.angular_rate.0) = (imu.angular_rate.0, imu.specific_force.0);
    sample
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

/// Duration of a piece, s.
const PIECE_S: f32 = 0.1;

/// Share of the pieces that counts as rest.
const REST_SHARE: f64 = 0.1;

/// Largest deviation of a steady reading, as a fraction of the reading.
const STEADY: f32 = 0.05;

/// Smallest number of pieces in a steady reading.
const LEAST_PIECES: usize = 5;

/// Accelerometer reading at rest.
struct Rest {
    /// Median of |a|, m/s².
    size: f32,
    /// Mean, m/s².
    mean: Vec3,
    /// Whether |a| is the same throughout the rest, as while a foot stands. A foot that never stops moving has no
    /// such rest.
    is_steady: bool,
}

/// Collects the variance and mean of each piece of a recording.
struct RestSearch {
    /// Samples per piece.
    length: usize,
    /// Samples in the current piece.
    samples: usize,
    sums: [f64; 3],
    squares: f64,
    /// Whether all its samples are valid.
    valid: bool,
    /// Variance and mean of the accelerations of each piece.
    pieces: Vec<(f32, Vec3)>,
}

impl RestSearch {
    fn new(sample_rate: f32) -> Self {
        Self {
            length: (sample_rate * PIECE_S).max(5.0) as usize,
            samples: 0,
            sums: [0.0; 3],
            squares: 0.0,
            valid: true,
            pieces: Vec::new(),
        }
    }

    fn add(&mut self, sample: &RecordedSample) {
        // A reading beyond any sensor's range may be in another unit, which this check is to find.
        let force = sample.imu.specific_force.0;
        self.valid &= is_number(force) && sample.imu.validity == Validity::Valid;
        for (sum, value) in self.sums.iter_mut().zip(components(force)) {
            *sum += f64::from(value);
            self.squares += f64::from(value) * f64::from(value);
        }
        self.samples += 1;
        if self.samples == self.length {
            self.end_piece();
        }
    }

    fn end_piece(&mut self) {
        if self.valid {
            let mean = self.sums.map(|sum| sum / self.samples as f64);
            let squared_mean: f64 = mean.iter().map(|value| value * value).sum();
            let variance = self.squares / self.samples as f64 - squared_mean;
            let [x, y, z] = mean.map(|value| value as f32);
            self.pieces.push((variance.max(0.0) as f32, Vec3::new(x, y, z)));
        }
        (self.samples, self.sums, self.squares) = (0, [0.0; 3], 0.0);
        self.valid = true;
    }

    /// Reading at rest; `None` if too few samples are valid.
    fn rest(&self) -> Option<Rest> {
        let mut pieces = self.pieces.clone();
        let count = ((pieces.len() as f64 * REST_SHARE).ceil() as usize).min(pieces.len());
        pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quiet = &pieces[..count];
        let mut sizes: Vec<f32> = quiet.iter().map(|(_, mean)| size(*mean)).collect();
        sizes.sort_by(f32::total_cmp);
        let mean = |component: fn(Vec3) -> f32| {
            let sum: f32 = quiet.iter().map(|(_, mean)| component(*mean)).sum();
            sum / count as f32
        };
        let size = *sizes.get(count / 2)?;
        let is_near = |other: &f32| (other - size).abs() < STEADY * size;
        let is_quiet = |(variance, _): &(f32, Vec3)| libm::sqrtf(*variance) < STEADY * size;
        Some(Rest {
            size,
            is_steady: count >= LEAST_PIECES
                && sizes.iter().all(is_near)
                && quiet.iter().all(is_quiet),
            mean: Vec3::new(mean(|v| v.x), mean(|v| v.y), mean(|v| v.z)),
        })
    }
}

/// Length of a vector.
fn size(Vec3 { x, y, z }: Vec3) -> f32 {
    libm::sqrtf(x * x + y * y + z * z)
}

/// Range of the gyroscopes on robots, 2000 °/s, in rad/s.
pub const LARGEST_RATE: f32 = 34.9;

/// Collects the magnitudes of rates.
#[derive(Default)]
struct RateCheck(Histogram);

impl RateCheck {
    fn add(&mut self, sample: &RecordedSample) {
        let rate = sample.imu.angular_rate.0;
        let largest = rate.x.abs().max(rate.y.abs()).max(rate.z.abs());
        if largest.is_finite() {
            self.0.add(largest);
        }
    }

    /// Finding about the unit.
    fn finding(&self) -> Option<Finding> {
        let percentile = self.0.quantile(0.99)?;
        (percentile > LARGEST_RATE).then_some(Finding::RateInDegrees { percentile })
    }
}

/// Low bits of an f32 that are dropped; the rest resolves sizes to 0.2 %.
const DROPPED_BITS: u32 = 14;

/// Sizes in bins of at most 0.2 % of their size.
struct Histogram {
    counts: Vec<u64>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: vec![0; 1 << (31 - DROPPED_BITS)], total: 0 }
    }
}

impl Histogram {
    /// Counts a size, which must not be negative.
    fn add(&mut self, size: f32) {
        let bin = (size.abs().to_bits() >> DROPPED_BITS) as usize;
        if let Some(count) = self.counts.get_mut(bin) {
            *count += 1;
            self.total += 1;
        }
    }

    /// Size below which a `share` of the values lies, in [0, 1], to the resolution of a bin; `None` if empty.
    fn quantile(&self, share: f64) -> Option<f32> {
        let wanted = ((self.total as f64 * share) as u64).min(self.total.checked_sub(1)?);
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > wanted
        })?;
        Some(f32::from_bits((bin as u32) << DROPPED_BITS))
    }
}

/// Time with the same readings from which the gyroscope is dead, s. A gyroscope that lives has noise; one that is simulated
/// without noise rests as long as the accelerometer does.
const LONGEST_S: f64 = 1.0;

/// Change of the acceleration from which the foot moves, m/s².
const MOVES: f32 = 0.5;

/// Looks for the longest time with the same angular rate in which the foot moves.
#[derive(Default)]
struct DeadCheck {
    run: Option<Run>,
    longest_s: f64,
}

/// Samples with the same angular rate.
struct Run {
    rate: Vec3,
    since: Timestamp,
    /// Acceleration of the first sample.
    force: Vec3,
    moves: bool,
}

impl DeadCheck {
    fn add(&mut self, sample: &RecordedSample) {
        let now = sample.imu.timestamp;
        let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        match &mut self.run {
            Some(run) if run.rate == rate => {
                run.moves |= (force - run.force).length() > MOVES;
                if run.moves {
                    let micros = now.micros_since(run.since).unwrap_or(0);
                    self.longest_s = self.longest_s.max(micros as f64 / 1.0e6);
                }
            }
            run => {
                *run = Some(Run { rate, since: now, force, moves: false });
            }
        }
    }

    /// Finding about the gyroscope.
    fn finding(&self) -> Option<Finding> {
        let longest_s = self.longest_s;
        (longest_s >= LONGEST_S).then_some(Finding::DeadGyroscope { longest_s })
    }
}

/// Time with the same six readings from which a sensor is frozen, s, …
const FROZEN_S: f64 = 2.0;

/// The same time if the angular rate is exactly 0, s. A foot that is simulated without noise may stand for some
/// seconds.
const FROZEN_WITHOUT_RATE_S: f64 = 10.0;

/// Looks for the longest time in which all six axes stay the same.
#[derive(Default)]
struct FrozenCheck {
    /// Reading of the current run, and the time of its first sample.
    run: Option<([Vec3; 2], Timestamp)>,
    newest: Option<Timestamp>,
    /// Duration in s and end of the longest run.
    longest: Option<(f64, Timestamp)>,
}

impl FrozenCheck {
    fn add(&mut self, sample: &RecordedSample) {
        let now = sample.imu.timestamp;
        let reading = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        self.newest = Some(now);
        match self.run {
            Some((held, since)) if held == reading => {
                let lasts_s = now.micros_since(since).unwrap_or(0) as f64 / 1.0e6;
                let [force, rate] = reading;
                let least_s = if rate == Vec3::ZERO { FROZEN_WITHOUT_RATE_S } else { FROZEN_S };
                let is_longest = self.longest.is_none_or(|(longest_s, _)| lasts_s > longest_s);
                // A simulated foot without gravity reads zeros at perfect rest.
                if lasts_s >= least_s && is_longest && force != Vec3::ZERO {
                    self.longest = Some((lasts_s, now));
                }
            }
            _ => self.run = Some((reading, now)),
        }
    }

    /// Finding about the sensor.
    fn finding(&self) -> Option<Finding> {
        let ((longest_s, end), newest) = (self.longest?, self.newest?);
        let before_end_s = newest.micros_since(end).unwrap_or(0) as f64 / 1.0e6;
        Some(Finding::FrozenSensor { longest_s, before_end_s })
    }
}

/// Step from which the clock jumps, s, if it is also [`UNUSUAL`].
const JUMP_S: f64 = 1.0;

/// Multiple of the median step from which a step is unusual.
const UNUSUAL: f64 = 20.0;

/// Collects the steps between samples.
#[derive(Default)]
struct ClockCheck {
    newest: Option<Timestamp>,
    steps: Steps,
}

impl ClockCheck {
    fn add(&mut self, now: Timestamp) {
        let before = self.newest.replace(now);
        if let Some(step) = before.and_then(|before| now.micros_since(before)) {
            self.steps.add(step);
        }
    }

    /// Findings about the times.
    fn findings(&self) -> Vec<Finding> {
        let sorted = self.steps.sorted();
        let Some(median_us) = median(&sorted) else {
            return Vec::new();
        };
        let total = self.steps.total() as f64;
        let sum: u64 = sorted.iter().map(|(step, count)| step * count).sum();
        let mean_us = sum as f64 / total;
        let jump_us = (1.0e6 * JUMP_S).max(UNUSUAL * median_us as f64);
        let jumps = sorted.iter().filter(|(step, _)| *step as f64 > jump_us);
        let count: u64 = jumps.map(|(_, count)| count).sum();
        let mut findings = Vec::new();
        if count > 0 {
            let longest_us = sorted.last().map_or(0, |(step, _)| *step);
            findings.push(Finding::ClockJumps {
                count: usize::try_from(count).unwrap_or(usize::MAX),
                longest_s: longest_us as f64 / 1.0e6,
            });
        }
        let short = sorted.iter().filter(|(step, _)| (*step as f64) < 0.25 * mean_us);
        let share = short.map(|(_, count)| count).sum::<u64>() as f64 / total;
        if share > 1.0 / 3.0 && count == 0 {
            findings.push(Finding::Batches { share });
        }
        findings
    }
}

/// Share of repeated readings from which they are held. In recordings with one reading per row, and of simulated
/// robots, it is at most 0.017; on a GO1 read at 70 Hz and held to 250 Hz, 0.72.
const HELD_SHARE: f64 = 0.25;

/// Longest run of repeats that counts as held; in longer ones a simulated foot rests or a sensor is stuck.
const LONGEST_HOLD: u64 = 50;

/// Counts readings that repeat the previous one, until a new one comes.
#[derive(Default)]
struct HeldCheck {
    newest: Option<[f32; 6]>,
    samples: u64,
    /// Length of the current run.
    run: u64,
    repeats: u64,
}

impl HeldCheck {
    fn add(&mut self, sample: &RecordedSample) {
        let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        let reading = [a.x, a.y, a.z, w.x, w.y, w.z];
        self.samples += 1;
        if self.newest.replace(reading) != Some(reading) {
            if self.run <= LONGEST_HOLD {
                self.repeats += self.run;
            }
            self.run = 0;
        } else if reading.iter().any(|axis| *axis != 0.0) {
            // A simulated foot without gravity reads zeros at perfect rest; they are real readings.
            self.run += 1;
        }
    }

    /// Finding about held readings in rows at `sample_rate`, Hz.
    fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let share = self.repeats as f64 / self.samples as f64;
        (share > HELD_SHARE).then_some(Finding::HeldReadings {
            samples: self.repeats,
            of: self.samples,
            rate: sample_rate * (1.0 - share) as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{AngularRate, ImuSample, SpecificForce, Timestamp, Validity, Vec3};

    use crate::mounting::{axes_text, parse_axes};

    #[test]
    fn quantile_is_right_to_its_bin() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for k in 1..=1000_u16 {
            histogram.add(f32::from(k));
        }
        for (share, exact) in [(0.0, 1.0), (0.5, 501.0), (0.99, 991.0), (1.0, 1000.0)] {
            let found = histogram.quantile(share).unwrap();
            assert!(found <= exact && found > 0.998 * exact, "{share}: {found}");
        }
    }

    /// A foot that rests and swings every second for 10 s at 200 Hz, with gravity along z.
    fn walk() -> Recording {
        let sample = |k: u64| {
            let phase = (k % 200) as f32 / 200.0;
            let swing = if phase < 0.5 { 0.0 } else { 1.0 };
            let wave = libm::sinf(40.0 * phase);
            RecordedSample {
                imu: ImuSample {
                    timestamp: Timestamp::from_micros(5_000 * k),
                    specific_force: SpecificForce(Vec3::new(
                        8.0 * swing * wave,
                        3.0 * swing * wave,
                        9.81 + 0.01 * wave + 5.0 * swing * wave,
                    )),
                    angular_rate: AngularRate(Vec3::new(0.0, 8.0 * swing * wave, 0.001)),
                    validity: Validity::Valid,
                },
                load: None,
                label: None,
            }
        };
        Recording {
            name: "walk".to_owned(),
            sample_rate: 200.0,
            gravity: Gravity::Included,
            load_title: String::new(),
            samples: (0..2000).map(sample).collect(),
        }
    }

    fn with_force(change: impl Fn(Vec3) -> Vec3) -> Recording {
        let mut recording = walk();
        for sample in &mut recording.samples {
            sample.imu.specific_force.0 = change(sample.imu.specific_force.0);
        }
        recording
    }

    fn with_times(micros: impl Fn(u64) -> u64) -> Recording {
        let mut recording = walk();
        for (k, sample) in (0..).zip(&mut recording.samples) {
            sample.imu.timestamp = Timestamp::from_micros(micros(k));
        }
        recording
    }

    /// The names of all findings.
    fn found(recording: &Recording) -> Vec<&'static str> {
        check(recording).iter().map(Finding::name).collect()
    }

    fn scaled(by: f32) -> impl Fn(Vec3) -> Vec3 {
        move |force| Vec3::new(force.x * by, force.y * by, force.z * by)
    }

    #[test]
    fn walk_has_no_finding() {
        assert_eq!(found(&walk()), [""; 0]);
    }

    /// Readings that are updated once in `rows` rows and held in between.
    fn held(rows: usize) -> Recording {
        let mut recording = walk();
        for k in 0..recording.samples.len() {
            let read = recording.samples[k - k % rows].imu;
            let imu = &mut recording.samples[k].imu;
            (imu.specific_force, imu.angular_rate) = (read.specific_force, read.angular_rate);
        }
        recording
    }

    #[test]
    fn held_readings_are_reported_with_their_number() {
        let mut recording = held(4);
        // The synthetic foot has noise at rest, too.
        for (k, sample) in (0..).zip(&mut recording.samples) {
            sample.imu.angular_rate.0.x = 1e-3 * (k / 4 % 7) as f32;
        }
        let finding = check(&recording).into_iter().find(|f| f.name() == "held_readings");
        let Some(Finding::HeldReadings { samples, of, rate }) = finding else {
            panic!("{finding:?}");
        };
        // The last three have no reading after them.
        assert_eq!((samples, of), (1497, 2000));
        assert!((rate - 50.0).abs() < 1.0, "{rate}");
    }

    #[test]
    fn perfect_rest_is_not_held() {
        let constant = with_force(|_| Vec3::new(0.0, 0.0, 9.81));
        assert!(!found(&constant).contains(&"held_readings"));
        let mut removed = held(4);
        removed.gravity = Gravity::Removed;
        for sample in &mut removed.samples {
            // At rest in three samples out of four.
            let moves = sample.imu.timestamp.as_micros() / 5_000 % 4 == 0;
            let force = if moves { 3.0 } else { 0.0 };
            sample.imu.specific_force.0 = Vec3::new(force, 0.0, 0.0);
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert!(!found(&removed).contains(&"held_readings"));
    }

    /// A foot that rests for 0.5 s and then swings for 0.5 s with a pitch of up to 1 rad, for 20 s at 500 Hz: each swing
    /// goes 0.4 m forth and 0.1 m up and down.
    fn pitching() -> Recording {
        use std::f64::consts::TAU;
        let sample = |k: u64| {
            let time = k as f64 / 500.0;
            // From 0 to 1 in the swing, with smooth ends.
            let phase = ((time % 1.0) * 2.0 - 1.0).max(0.0);
            let bump = libm::sin(0.5 * TAU * phase).powi(4);
            let slope = |f: fn(f64) -> f64| {
                let step = 1.0e-4;
                (f(phase + step) - 2.0 * f(phase) + f(phase - step)) / (step * step) * 4.0
            };
            let swings = phase > 0.0;
            let forward = |p: f64| 0.4 * (p - libm::sin(TAU * p) / TAU);
            let upward = |p: f64| 0.1 * libm::sin(0.5 * TAU * p).powi(4);
            let (x, z) = if swings { (slope(forward), slope(upward)) } else { (0.0, 0.0) };
            let cosine = libm::cos(0.5 * TAU * phase);
            let rate = 2.0 * 4.0 * 0.5 * TAU * libm::sin(0.5 * TAU * phase).powi(3) * cosine;
            let rate = if swings { rate } else { 0.0 };
            let (sine, cosine) = (libm::sin(bump), libm::cos(bump));
            let gravity = 9.81 + z;
            let noise = 1.0e-3 * (k % 7) as f32;
            let force = Vec3::new(
                (cosine * x - sine * gravity) as f32 + noise,
                noise,
                (sine * x + cosine * gravity) as f32,
            );
            RecordedSample {
                imu: ImuSample {
                    timestamp: Timestamp::from_micros(2_000 * k),
                    specific_force: SpecificForce(force),
                    angular_rate: AngularRate(Vec3::new(0.0, rate as f32, 0.01)),
                    validity: Validity::Valid,
                },
                load: None,
                label: None,
            }
        };
        Recording { sample_rate: 500.0, samples: (0..10_000).map(sample).collect(), ..walk() }
    }

    fn with_both(mut recording: Recording, change: impl Fn(Vec3) -> Vec3) -> Recording {
        for sample in &mut recording.samples {
            let imu = &mut sample.imu;
            imu.specific_force.0 = change(imu.specific_force.0);
            imu.angular_rate.0 = change(imu.angular_rate.0);
        }
        recording
    }

    #[test]
    fn mirrored_axes_are_left_handed_and_turned_ones_are_not() {
        type Change = fn(Vec3) -> Vec3;
        let right: [Change; 3] =
            [|v| v, |v| Vec3::new(v.y, -v.x, v.z), |v| Vec3::new(-v.x, -v.y, v.z)];
        for change in right {
            assert_eq!(found(&with_both(pitching(), change)), [""; 0]);
        }
        let left: [(Change, &str); 4] = [
            (|v| Vec3::new(-v.x, v.y, v.z), "z"),
            (|v| Vec3::new(v.y, v.x, v.z), "z"),
            (|v| Vec3::new(v.x, v.z, v.y), "y"),
            (|v| Vec3::new(v.z, v.y, v.x), "x"),
        ];
        for (change, up) in left {
            let findings = check(&with_both(pitching(), change));
            assert_eq!(findings, [Finding::LeftHanded { up }]);
        }
    }

    #[test]
    fn advice_for_left_handed_axes_repairs_them() {
        let exchanged = with_both(pitching(), |v| Vec3::new(v.x, v.z, v.y));
        assert_eq!(
            check(&exchanged)[0].to_string(),
            "the axes are left-handed: gravity turns against the angular rate, and y is up, as where y and z are \
             exchanged: map ay=az,az=ay,wy=wz,wz=wy"
        );
        assert_eq!(found(&with_both(exchanged, |v| Vec3::new(v.x, v.z, v.y))), [""; 0]);
        let mut mirrored = with_both(pitching(), |v| Vec3::new(v.x, -v.y, v.z));
        assert_eq!(
            check(&mirrored)[0].to_string(),
            "the axes are left-handed: gravity turns against the angular rate: one axis has the wrong sign, or two are \
             exchanged; scale 1,-1 repairs it"
        );
        for sample in &mut mirrored.samples {
            sample.imu.angular_rate.0 = sample.imu.angular_rate.0 * -1.0;
        }
        assert_eq!(found(&mirrored), [""; 0]);
        // Of a foot that is read with a mounting, the columns to exchange are not known.
        let mounting = parse_axes("x,-z,y").expect("axes");
        let finding = Finding::LeftHanded { up: "y" }.with_mounting(&mounting);
        assert_eq!(finding, Finding::LeftHanded { up: "z" });
    }

    #[test]
    fn exchanged_sensors_are_found_with_their_mapping() {
        let mut recording = pitching();
        for sample in &mut recording.samples {
            *sample = with_exchanged_sensors(sample);
        }
        assert_eq!(found(&recording), ["exchanged_sensors"]);
        let said = check(&recording)[0].to_string();
        assert!(
            said.ends_with("were exchanged: map ax=wx,ay=wy,az=wz,wx=ax,wy=ay,wz=az"),
            "{said}"
        );
    }

    #[test]
    fn frozen_sensor_is_found_with_its_place() {
        let frozen = |range: std::ops::Range<usize>| {
            let mut recording = pitching();
            let held = recording.samples[range.start].imu;
            for sample in &mut recording.samples[range] {
                let imu = &mut sample.imu;
                (imu.specific_force, imu.angular_rate) = (held.specific_force, held.angular_rate);
            }
            check(&recording)
        };
        let all = frozen(0..10_000);
        let at_end = frozen(5_000..10_000);
        let within = frozen(4_000..6_000);
        let finding = |findings: &[Finding]| match findings {
            [Finding::FrozenSensor { longest_s, before_end_s }] => {
                (longest_s.round(), before_end_s.round())
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(finding(&all), (20.0, 0.0));
        assert_eq!(finding(&at_end), (10.0, 0.0));
        assert_eq!(finding(&within), (4.0, 8.0));
        assert!(all[0].to_string().contains("for 20.0 s, up to the end"), "{}", all[0]);
        assert_eq!(frozen(4_000..4_900), []);
    }

    #[test]
    fn perfect_rest_is_frozen_after_ten_seconds_alone() {
        for (seconds, is_found) in [(9, false), (11, true)] {
            let mut recording = walk();
            recording.samples.truncate(200 * seconds);
            for sample in &mut recording.samples {
                sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
                sample.imu.angular_rate.0 = Vec3::ZERO;
            }
            let mut last = *recording.samples.last().expect("samples");
            last.imu.timestamp = Timestamp::from_micros(1_000_000 * seconds as u64);
            recording.samples.push(last);
            assert_eq!(found(&recording).contains(&"frozen_sensor"), is_found);
        }
    }

    fn with_loads(stance: f32, swing: f32) -> Vec<Finding> {
        let mut recording = walk();
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let level = if k % 200 < 100 { stance } else { swing };
            let noise = (k % 7) as f32 / 100.0 * (stance - swing);
            sample.load = Some(estimator_core::Load(level + noise));
        }
        check_with_load(&recording, LoadParams { on_threshold: 12.0, off_threshold: 6.0 })
    }

    #[test]
    fn load_that_never_crosses_is_found_with_thresholds() {
        assert_eq!(with_loads(40.0, 0.0), []);
        for (stance, swing) in [(1.0, 0.0), (300.0, 80.0)] {
            let findings = with_loads(stance, swing);
            let [Finding::LoadNeverCrosses { on, off, .. }] = findings[..] else {
                panic!("{findings:?}");
            };
            assert!(swing < off && off < on && on < stance, "{off}, {on}");
        }
        let said = with_loads(300.0, 80.0)[0].to_string();
        assert!(said.contains(": on_threshold = 15"), "{said}");
        // A foot that only stands or only swings shows no levels.
        assert_eq!(with_loads(3.0, 3.0), []);
    }

    #[test]
    fn load_of_a_walk_after_a_long_stand_is_found() {
        let mut recording = walk();
        let half = recording.samples.len() * 7 / 10;
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let load = match k % 200 {
                _ if k < half => 229.0 + (k % 3) as f32,
                0..100 => 487.0,
                _ => 13.0,
            };
            sample.load = Some(estimator_core::Load(load));
        }
        let found = |on_threshold, off_threshold| {
            check_with_load(&recording, LoadParams { on_threshold, off_threshold })
        };
        let [Finding::LoadNeverCrosses { on, off, .. }] = found(12.0, 6.0)[..] else {
            panic!("{:?}", found(12.0, 6.0));
        };
        assert!(13.0 < off && off < on && on < 229.0, "{off}, {on}");
        assert_eq!(found(on, off), []);
        for sample in &mut recording.samples {
            sample.load = sample.load.map(|load| estimator_core::Load(13.0 - load.0));
        }
        let found =
            check_with_load(&recording, LoadParams { on_threshold: 12.0, off_threshold: 6.0 });
        assert!(matches!(found[..], [Finding::LoadNegative { .. }]), "{found:?}");
    }

    #[test]
    fn load_of_a_foot_that_only_stands_has_one_level() {
        let mut recording = walk();
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let noise: f32 =
                [0.7, 1.3, 2.9, 3.7, 5.3].map(|rate: f32| (rate * k as f32).sin()).iter().sum();
            sample.load = Some(estimator_core::Load(229.0 + noise));
        }
        let thresholds = LoadParams { on_threshold: 12.0, off_threshold: 6.0 };
        assert_eq!(check_with_load(&recording, thresholds), []);
    }

    #[test]
    fn negative_load_is_found() {
        let names: Vec<_> = with_loads(-40.0, 0.0).iter().map(Finding::name).collect();
        assert_eq!(names, ["load_negative"]);
    }

    #[test]
    fn accelerations_in_g_are_found_with_and_without_gravity() {
        let mut recording = with_force(scaled(1.0 / 9.81));
        assert_eq!(found(&recording), ["acceleration_in_g"]);
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), ["acceleration_in_g"]);
    }

    #[test]
    fn gravity_contradicting_its_declaration_is_found() {
        let mut recording = walk();
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), ["gravity_included"]);
        let said = check(&recording)[0].to_string();
        assert!(said.ends_with(" m/s² at rest: gravity included"), "{said}");
        let mut recording = with_force(|force| Vec3::new(force.x, force.y, force.z - 9.81));
        assert_eq!(found(&recording), ["gravity_removed"]);
        let said = check(&recording)[0].to_string();
        assert!(said.ends_with(" m/s² at rest: gravity removed"), "{said}");
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), [""; 0]);
    }

    #[test]
    fn sensor_on_its_side_is_found_with_the_axis_up() {
        let up = |recording: &Recording| match check(recording)[..] {
            [Finding::GravityNotAlongZ { up, axes }] => (up, axes_text(&axes)),
            ref other => panic!("{other:?}"),
        };
        let is = |up: &'static str, axes: &str| (up, axes.to_owned());
        let side = with_force(|f| Vec3::new(-f.z, f.y, f.x));
        assert_eq!(up(&side), is("-x", "z,y,-x"));
        let y_up = with_force(|f| Vec3::new(f.x, f.z, -f.y));
        assert_eq!(up(&y_up), is("y", "x,-z,y"));
        assert_eq!(up(&with_force(scaled(-1.0))), is("-z", "x,-y,-z"));
        // A foot may stand at 30°.
        let tilted = with_force(|f| Vec3::new(f.x + 0.5 * f.z, f.y, 0.866 * f.z));
        assert_eq!(found(&tilted), [""; 0]);
    }

    #[test]
    fn wrong_mounting_is_replaced_by_a_right_one() {
        // y of the sensor is up, but was declared as x of the foot.
        let wrong = parse_axes("y,z,x").expect("axes");
        let recording = with_force(|f| wrong.turn(Vec3::new(f.x, f.z, -f.y)));
        let [finding] = check(&recording)[..] else {
            panic!("one finding");
        };
        assert_eq!(
            finding.with_mounting(&wrong).to_string(),
            "x is up at rest, where the foot has z: axes -x,z,y"
        );
        let right = parse_axes("-x,z,y").expect("axes");
        let recording = with_force(|f| right.turn(Vec3::new(f.x, f.z, -f.y)));
        assert_eq!(found(&recording), [""; 0]);
    }

    #[test]
    fn gravity_at_rest_is_returned_if_present() {
        let up = gravity_at_rest(&walk()).expect("gravity");
        assert!((up - Vec3::new(0.0, 0.0, 9.81)).length() < 0.1, "{up:?}");
        let removed = Recording { gravity: Gravity::Removed, ..walk() };
        assert_eq!(gravity_at_rest(&removed), None);
        assert_eq!(gravity_at_rest(&with_force(scaled(0.1))), None);
    }

    #[test]
    fn rates_in_degrees_are_found() {
        let mut recording = walk();
        for sample in &mut recording.samples {
            let rate = &mut sample.imu.angular_rate.0;
            *rate = Vec3::new(rate.x.to_degrees(), rate.y.to_degrees(), rate.z.to_degrees());
        }
        assert_eq!(found(&recording), ["rate_in_degrees"]);
    }

    #[test]
    fn gyroscope_that_stops_is_dead_unless_the_foot_rests() {
        let mut recording = walk();
        // From the middle of a swing on.
        for sample in &mut recording.samples[950..1200] {
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert_eq!(found(&recording), ["dead_gyroscope"]);
        for sample in &mut recording.samples {
            sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert!(!found(&recording).contains(&"dead_gyroscope"));
    }

    #[test]
    fn accelerations_in_mg_or_counts_are_found() {
        // Half and twice are of another full scale.
        for factor in [0.5, 2.0, 1000.0 / 9.81, 2048.0 / 9.81, 16384.0 / 9.81, 16384.0] {
            let found = found(&with_force(scaled(factor)));
            assert_eq!(found, ["acceleration_in_other_unit"], "{factor}");
        }
        // As read in g.
        let counts = check(&with_force(scaled(16384.0)));
        assert_eq!(
            counts[0].to_string(),
            "the acceleration is 160800 m/s² at rest, 16397 times gravity, so it is in another unit or of \
         another full scale: units m/s2, g or mg, or scale with the value of a count"
        );
    }

    #[test]
    fn non_numbers_are_found_from_one_percent_on() {
        let without = |one_in: usize, at: usize| {
            let mut recording = walk();
            for sample in recording.samples.iter_mut().skip(at).step_by(one_in) {
                sample.imu.angular_rate.0.y = f32::NAN;
            }
            check(&recording)
        };
        assert_eq!(without(150, 7), []);
        let half = Finding::NotNumbers { samples: 1000, of: 2000 };
        assert_eq!(without(2, 0), [half]);
    }

    #[test]
    fn clock_jump_is_found_but_short_gap_is_not() {
        let gap =
            |length_us: u64| with_times(move |k| 5_000 * k + if k < 900 { 0 } else { length_us });
        assert_eq!(found(&gap(5_000_000)), ["clock_jumps"]);
        assert_eq!(found(&gap(500_000)), [""; 0]);
        assert_eq!(
            check(&gap(5_000_000))[0].to_string(),
            "the clock jumps once, by up to 5.0 s: samples are missing, or times rate"
        );
    }

    #[test]
    fn batches_are_found_but_jitter_is_not() {
        let batches = with_times(|k| k / 10 * 50_000 + k % 10);
        assert_eq!(found(&batches), ["batches"]);
        let jitter = with_times(|k| 5_000 * k + (k * 7919) % 3_000);
        assert_eq!(found(&jitter), [""; 0]);
    }

    #[test]
    fn rate_below_the_slowest_recordings_is_found() {
        let slower = |rate: f32| Recording { sample_rate: rate, ..walk() };
        assert_eq!(found(&slower(50.0)), ["low_rate"]);
        assert_eq!(found(&slower(99.5)), [""; 0]);
    }

    #[test]
    fn recording_without_valid_samples_has_no_other_finding() {
        let mut recording = with_force(|_| Vec3::new(f32::NAN, 0.0, 0.0));
        assert_eq!(found(&recording), ["not_numbers"]);
        recording.samples.clear();
        assert_eq!(found(&recording), [""; 0]);
    }
}
