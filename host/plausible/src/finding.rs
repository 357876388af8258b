//! The findings: their names, conditions, texts and remedies.

use std::fmt::{self, Formatter};

use estimator_core::Gravity;
use estimator_core::mounting::Mounting;
use estimator_core::params::STANDARD_GRAVITY;
use options::hint::{Hint, InWords, Vocabulary};
use options::{AccelerationUnit, RateUnit, display_in_plain_words};
use samples::mounting;

use crate::limits::{LARGEST_REST, LOWEST_RATE};

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
    /// Angular rates look like revolutions per minute, but are read as rad/s.
    RateInRevolutions {
        /// Rate exceeded by one sample in a hundred, rad/s.
        percentile: f32,
    },
    /// Angular rates look like thousandths of °/s, but are read as rad/s.
    RateInMilliDegrees {
        /// Rate exceeded by one sample in a hundred, rad/s.
        percentile: f32,
    },
    /// Angular rates look like °/s or revolutions per minute, but are read as rad/s.
    RateInDegreesOrRevolutions {
        /// Rate exceeded by one sample in a hundred, rad/s.
        percentile: f32,
    },
    /// Angular rates are in an unsupported unit.
    RateInOtherUnit {
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
        /// End of the stretch, s before the end of the recording.
        before_end_s: f64,
    },
    /// The columns of the accelerometer contain angular rates, and the columns of the gyroscope accelerations.
    ExchangedSensors {
        /// Angular rate at rest as read, rad/s: in truth gravity.
        at_rest: f32,
    },
    /// The axes are a mirror image: gravity turns against the angular rate.
    LeftHanded {
        /// The axis of the sensor that is up at rest, such as `y`.
        up: &'static str,
    },
    /// Accelerometer and gyroscope have different axes.
    DifferentAxes {
        /// For each axis the axis of the gyroscope that lies along it, from 1, negative in the opposite direction;
        /// `None` if several ways fit, or if the samples were turned.
        gyroscope: Option<[i8; 3]>,
    },
    /// The readings of several feet alternate.
    MixedFeet {
        /// Number of feet.
        feet: usize,
    },
    /// An axis stays the same while the others of its sensor move.
    DeadAxis {
        /// Name of the axis, such as `wy`.
        axis: &'static str,
        /// Longest such time, s.
        longest_s: f64,
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
        /// Number of samples that repeat the previous sample.
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
        samples::named! {
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
    RateInRevolutions = "rate_in_rpm",
        "the same, and gravity turns in swings as if the rates were in revolutions per minute";
    RateInMilliDegrees = "rate_in_millidegrees", "the same, and the rates are beyond the range of gyroscopes in °/s, too";
    RateInDegreesOrRevolutions = "rate_in_degrees_or_rpm",
        "the same, and the rates fit °/s and revolutions per minute, because swings do not show which";
    RateInOtherUnit = "rate_in_other_unit", "the same, and the rates fit none of these units";
    DeadGyroscope = "dead_gyroscope", "the angular rate stays the same for a second, though the acceleration changes";
    FrozenSensor = "frozen_sensor",
        "all six axes stay the same for two seconds, or for ten if the angular rate is exactly 0";
    ExchangedSensors = "exchanged_sensors",
        "the angular rate at rest is steady and as large as gravity, and the acceleration is near 0";
    LeftHanded = "left_handed", "swings end at rest only if the angular rate is taken with the opposite sign";
    DifferentAxes = "different_axes",
        "swings end at rest only if the axes of the gyroscope are exchanged among each other";
    MixedFeet = "mixed_feet", "every second, third or fourth sample is of a foot that stands while others swing";
    DeadAxis = "dead_axis", "one axis stays the same for a second, though others of its sensor change";
    GravityIncluded = "gravity_included", "gravity is declared removed, but the acceleration at rest has it";
    GravityRemoved = "gravity_removed", "gravity is declared included, but the acceleration at rest is near 0";
    GravityNotAlongZ = "gravity_not_along_z", "another axis than z is within 30° of up at rest";
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
            Self::RateInRevolutions { .. } => Hint::RateUnit(RateUnit::RevolutionsPerMinute),
            Self::RateInMilliDegrees { .. } => Hint::RateUnit(RateUnit::MilliDegreesPerSecond),
            Self::RateInDegreesOrRevolutions { .. } => Hint::DegreesOrRevolutions,
            Self::RateInOtherUnit { .. } => Hint::OtherRateUnit,
            Self::DifferentAxes { gyroscope } => Hint::ExchangeColumns(rates_along((*gyroscope)?)),
            Self::MixedFeet { .. } => Hint::SplitFeet,
            Self::GravityIncluded { .. } => Hint::Gravity(Gravity::Included),
            Self::GravityRemoved { .. } => Hint::Gravity(Gravity::Removed),
            Self::GravityNotAlongZ { axes, .. } => Hint::Axes(*axes),
            Self::LoadNeverCrosses { on, off, .. } => Hint::LoadThresholds { on: *on, off: *off },
            Self::ClockJumps { .. } => Hint::MissingSamples,
            Self::Batches { .. } => Hint::SpaceRows,
            Self::ExchangedSensors { .. } => {
                Hint::ExchangeColumns("ax=wx,ay=wy,az=wz,wx=ax,wy=ay,wz=az".to_owned())
            }
            Self::LeftHanded { up } => match *up {
                "y" => Hint::ExchangeColumns("ay=az,az=ay,wy=wz,wz=wy".to_owned()),
                "x" => Hint::ExchangeColumns("ax=az,az=ax,wx=wz,wz=wx".to_owned()),
                _ => Hint::TurnRatesAround,
            },
            Self::LoadNegative { .. } => Hint::TurnLoadAround,
            Self::NotNumbers { .. }
            | Self::FrozenSensor { .. }
            | Self::DeadGyroscope { .. }
            | Self::DeadAxis { .. }
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
            Self::RateInRevolutions { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like revolutions \
                 per minute"
            ),
            Self::RateInMilliDegrees { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like thousandths \
                 of °/s"
            ),
            Self::RateInDegreesOrRevolutions { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, which looks like °/s or \
                 revolutions per minute, and no swing shows which"
            ),
            Self::RateInOtherUnit { percentile } => write!(
                f,
                "the angular rate exceeds {percentile:.0} rad/s in every hundredth sample, and is in another unit or of \
                 another full scale"
            ),
            Self::DifferentAxes { gyroscope } => {
                f.write_str(
                    "accelerometer and gyroscope have different axes: gravity does not turn with the angular rate",
                )?;
                if gyroscope.is_none() {
                    f.write_str("; compare the axes of both in the data sheet")?;
                }
                Ok(())
            }
            Self::MixedFeet { feet } => write!(
                f,
                "the readings of {feet} feet alternate, as if they were of one foot at {feet} times the rate"
            ),
            Self::DeadAxis { axis, longest_s } => write!(
                f,
                "{axis} is the same in each sample for {longest_s:.1} s, though the other axes change: it is dead, or not \
                 recorded"
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

    /// Returns the same finding for a recording to which `mounting` was already applied. The suggested mounting replaces
    /// `mounting`.
    #[must_use]
    pub fn with_mounting(self, mounting: &Mounting) -> Self {
        match self {
            Self::GravityNotAlongZ { up, axes } => {
                Self::GravityNotAlongZ { up, axes: mounting::then(mounting, &axes) }
            }
            Self::DifferentAxes { .. } if *mounting != Mounting::default() => {
                Self::DifferentAxes { gyroscope: None }
            }
            // The columns belong to the sensor.
            Self::LeftHanded { .. } if *mounting != Mounting::default() => {
                Self::LeftHanded { up: "z" }
            }
            other => other,
        }
    }
}

/// Mapping of the angular rates to axes, from 1, negative in the opposite direction.
fn rates_along(axes: [i8; 3]) -> String {
    const NAMES: [&str; 3] = ["wx", "wy", "wz"];
    let pairs = NAMES.iter().zip(axes).map(|(ours, axis)| {
        let sign = if axis < 0 { "-" } else { "" };
        (*ours, format!("{sign}{}", NAMES[usize::from(axis.unsigned_abs()) - 1]))
    });
    let changed = pairs.filter(|(ours, theirs)| ours != theirs);
    changed.map(|(ours, theirs)| format!("{ours}={theirs}")).collect::<Vec<_>>().join(",")
}

fn times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        count => format!("{count} times"),
    }
}

/// Decimals with which an acceleration of about g, or far above g, is written.
fn decimals(at_rest: f32) -> usize {
    if at_rest > LARGEST_REST { 0 } else { 2 }
}
