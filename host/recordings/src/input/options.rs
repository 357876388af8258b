//! Properties of a recording that its format does not carry: those of its sensor, of a table of other origin (mapping
//! of columns, units, scale, times), and the topics of a bag.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use estimator_core::correction::AccelerometerCorrection;
use estimator_core::mounting::Mounting;
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{AngularRate, Axis, Gravity, ImuSample, SpecificForce, Vec3};
use thiserror::Error;

use crate::hint::{Hint, Notice};

/// Properties of a file that its format does not define.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputOptions {
    /// Sample rate in Hz, above 0, if given.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, if different from the format's default.
    pub gravity: Option<Gravity>,
    /// Static calibration and mounting of the sensor.
    pub correction: Correction,
    /// Corrections of single feet, which replace `correction`: by the name of the foot, or of a recording of one foot.
    pub foot_corrections: BTreeMap<String, Correction>,
    /// Interpretation of named columns. Units, scale and the treatment of times also apply to bags, and the mapping to
    /// messages of other types in them.
    pub table: TableOptions,
    /// Topics of a bag that are read.
    pub bag: BagOptions,
    /// Whether the contacts in a bag are the estimates; [`Stored`](super::Stored) then describes the contacts.
    pub contacts: ContactUse,
}

impl InputOptions {
    /// Correction of a foot with these names: its own, else that of all feet.
    #[must_use]
    pub fn correction_of(&self, names: &[&str]) -> &Correction {
        let mut own = self.foot_corrections.iter();
        own.find(|(foot, _)| is_among(foot, names))
            .map_or(&self.correction, |(_, correction)| correction)
    }
}

/// Returns whether a foot is among names. Upper and lower case of ASCII letters are equal.
pub fn is_among(foot: &str, names: impl IntoIterator<Item = impl AsRef<str>>) -> bool {
    let mut names = names.into_iter();
    names.any(|name| name.as_ref().eq_ignore_ascii_case(foot))
}

/// Errors of a sensor, and its mounting in the foot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Correction of the accelerometer, in single precision and bit-exact with the foot's.
    pub accelerometer: AccelerometerCorrection,
    /// Gyroscope reading at rest, rad/s.
    pub gyroscope_bias: Vec3,
    /// Mounting of the sensor in the foot; the errors above are along the sensor's own axes.
    pub mounting: Mounting,
}

impl Correction {
    /// An ideal sensor whose axes are those of the foot.
    pub const NONE: Self = Self {
        accelerometer: AccelerometerCorrection::NONE,
        gyroscope_bias: Vec3::ZERO,
        mounting: Mounting::IDENTITY,
    };

    /// Returns the corrected readings in the frame of the foot.
    #[must_use]
    pub fn apply(&self, force: SpecificForce, rate: AngularRate) -> (SpecificForce, AngularRate) {
        let mut force = self.accelerometer.apply(force);
        let mut rate = AngularRate(rate.0 - self.gyroscope_bias);
        self.mounting.apply(&mut force, &mut rate);
        (force, rate)
    }

    /// Returns a sample with the corrected readings.
    #[must_use]
    pub fn corrected(&self, imu: ImuSample) -> ImuSample {
        let (specific_force, angular_rate) = self.apply(imu.specific_force, imu.angular_rate);
        ImuSample { specific_force, angular_rate, ..imu }
    }
}

/// Source of the estimates of a recording that has contacts of its foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactUse {
    /// The contacts are ignored.
    #[default]
    Ignored,
    /// The contacts are the estimates.
    Recorded,
}

impl ContactUse {
    /// Returns the use of contacts in a recording whose estimates may be computed again from its samples.
    #[must_use]
    pub const fn unless_estimated(again: bool) -> Self {
        if again { Self::Ignored } else { Self::Recorded }
    }
}

/// Returns a notice about given options that only change an estimate, for a file whose contacts are its estimates;
/// `None` without such an option.
#[must_use]
pub fn without_effect(file: &str, options: &[&str]) -> Option<Notice> {
    let named = options.join(", ");
    (!options.is_empty()).then(|| {
        let text =
            format!("{file}: {named} apply to estimates, not to contacts as they were recorded");
        Notice::with_hint(text, Hint::EstimateAgain)
    })
}

/// Reason why the text of an option is invalid.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OptionProblem {
    /// This is not a [`Scale`].
    #[error(
        "{0:?} is no scale: write the factors of accelerometer and gyroscope, finite and not 0, such as \
         0.000122,0.07 with units g,dps; a third is that of the load"
    )]
    Scale(String),
    /// This is not the name of a unit.
    #[error("{0:?} is not a unit: write m/s2 or g, and rad/s or dps, such as g,dps")]
    UnknownUnit(String),
    /// These are two units of the same sensor.
    #[error("{0:?} has two units for one sensor: write m/s2 or g, and rad/s or dps")]
    TwoUnits(String),
    /// This part of a [`Mapping`] has no equals sign.
    #[error("{0:?} is not a pair: write OURS=THEIRS, such as ax=linear_acceleration.x")]
    NotAPair(String),
    /// This is not one of our names of columns.
    #[error(
        "there is no column {0:?} to map to; there are {axes}, {others}",
        axes = Axis::ALL.map(Axis::name).join(", "),
        others = OTHERS.join(", ")
    )]
    UnknownColumn(String),
    /// Two columns of the file are mapped to this one of ours.
    #[error("{0} is mapped twice")]
    MappedTwice(&'static str),
    /// This column of the file is mapped to two of ours.
    #[error("column {0:?} is mapped twice")]
    TakenTwice(String),
    /// This is not a [`LoadTopic`].
    #[error(
        "{0:?} is not a topic: write TOPIC or TOPIC:FIELD, such as /foot/wrench:force.z or /lowstate:foot_force[0]"
    )]
    LoadTopic(String),
    /// This is not a [`Rename`].
    #[error("{0:?} is not a name: write OLD=NEW, such as leg_1=FL")]
    Rename(String),
}

/// Properties of a `csv` beyond its header. The default is a table of ours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableOptions {
    /// Mapping of columns to ours.
    pub mapping: Mapping,
    /// The units of the six axes.
    pub units: Units,
    /// Factors of the readings, applied before the units, and of the load.
    pub scale: Scale,
    /// Mark before the fraction of numbers in a text.
    pub decimal: Decimal,
    /// Unit of the times, if given.
    pub time_unit: Option<TimeUnit>,
    /// Treatment of times that are not in order.
    pub times: Times,
}

impl TableOptions {
    /// Converts six readings to SI units, accelerations first.
    #[must_use]
    pub fn to_si(&self, readings: [f64; 6]) -> [f64; 6] {
        let [ax, ay, az, wx, wy, wz] = readings;
        let (a, w) = (self.scale.acceleration, self.scale.rate);
        let scaled = [a * ax, a * ay, a * az, w * wx, w * wy, w * wz];
        self.units.to_si(scaled)
    }
}

/// Factors of readings, such as the units of a count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Of the accelerometer, finite and not 0.
    pub acceleration: f64,
    /// Of the gyroscope, finite and not 0.
    pub rate: f64,
    /// Of the load, finite and not 0.
    pub load: f64,
}

impl Default for Scale {
    fn default() -> Self {
        Self { acceleration: 1.0, rate: 1.0, load: 1.0 }
    }
}

impl fmt::Display for Scale {
    /// Writes factors as [`FromStr`] reads them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.acceleration, self.rate)?;
        if self.load == 1.0 { Ok(()) } else { write!(f, ",{}", self.load) }
    }
}

impl FromStr for Scale {
    type Err = OptionProblem;

    /// Reads numbers separated by commas: the factors of accelerometer and gyroscope, and of the load, if given.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let factor = |text: &str| -> Option<f64> {
            let factor = text.trim().parse().ok()?;
            (f64::is_finite(factor) && factor != 0.0).then_some(factor)
        };
        let factors: Option<Vec<f64>> = text.split(',').map(factor).collect();
        match factors.as_deref() {
            Some(&[acceleration, rate]) => Ok(Self { acceleration, rate, ..Self::default() }),
            Some(&[acceleration, rate, load]) => Ok(Self { acceleration, rate, load }),
            _ => Err(OptionProblem::Scale(text.to_owned())),
        }
    }
}

crate::named! {
    /// Mark before the fraction of a number.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Decimal {
        /// `1.5`.
        #[default]
        Point = ".",
        /// `1,5`.
        Comma = ",",
    } or |name| format!("invalid {name:?}: expected . or ,")
}

/// Units of a table's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Units {
    /// Unit of `ax`, `ay` and `az`.
    pub acceleration: AccelerationUnit,
    /// Unit of `wx`, `wy` and `wz`.
    pub rate: RateUnit,
}

crate::named! {
    /// A unit of acceleration.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum AccelerationUnit {
        /// m/s².
        #[default]
        MetresPerSecondSquared = "m/s2",
        /// g, 9.80665 m/s².
        StandardGravity = "g",
        /// A thousandth of g.
        MilliG = "mg",
    }
}

crate::named! {
    /// A unit of angular rate.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum RateUnit {
        /// rad/s.
        #[default]
        RadiansPerSecond = "rad/s",
        /// °/s.
        DegreesPerSecond = "dps",
        /// A thousandth of °/s.
        MilliDegreesPerSecond = "mdps",
    }
}

impl AccelerationUnit {
    /// The unit with this spelling.
    pub(super) fn written(text: &str) -> Option<Self> {
        Self::of_name(match &*short(text) {
            "m/s^2" | "m/s²" | "m/s/s" | "m/s**2" | "ms^-2" | "m*s^-2" | "m/(s^2)" => "m/s2",
            "milli-g" | "millig" => "mg",
            name => name,
        })
    }
}

impl RateUnit {
    /// The unit with this spelling.
    pub(super) fn written(text: &str) -> Option<Self> {
        Self::of_name(match &*short(text) {
            "deg/s" => "dps",
            "mdeg/s" | "millideg/s" => "mdps",
            name => name,
        })
    }
}

/// A spelling in small letters with short words: `deg/s` for `Degrees/Second`.
fn short(text: &str) -> String {
    let mut text = text.to_lowercase().replace(' ', "");
    for (word, short) in [
        ("degrees", "deg"),
        ("degree", "deg"),
        ("°", "deg"),
        ("radians", "rad"),
        ("radian", "rad"),
        ("meters", "m"),
        ("metres", "m"),
        ("seconds", "s"),
        ("second", "s"),
        ("sec", "s"),
        ("per", "/"),
    ] {
        text = text.replace(word, short);
    }
    text
}

impl Units {
    /// Returns whether this is the name of a unit.
    pub(super) fn are_named(text: &str) -> bool {
        AccelerationUnit::written(text).is_some() || RateUnit::written(text).is_some()
    }

    /// Converts six readings to SI units, accelerations first; SI readings are unchanged.
    #[must_use]
    pub fn to_si(self, readings: [f64; 6]) -> [f64; 6] {
        let g = f64::from(STANDARD_GRAVITY);
        let acceleration = |value: f64| match self.acceleration {
            AccelerationUnit::MetresPerSecondSquared => value,
            AccelerationUnit::StandardGravity => value * g,
            AccelerationUnit::MilliG => value / 1000.0 * g,
        };
        let rate = |value: f64| match self.rate {
            RateUnit::RadiansPerSecond => value,
            RateUnit::DegreesPerSecond => value.to_radians(),
            RateUnit::MilliDegreesPerSecond => (value / 1000.0).to_radians(),
        };
        let [ax, ay, az] = [readings[0], readings[1], readings[2]].map(acceleration);
        let [wx, wy, wz] = [readings[3], readings[4], readings[5]].map(rate);
        [ax, ay, az, wx, wy, wz]
    }
}

impl fmt::Display for Units {
    /// Writes units as [`FromStr`] reads them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.acceleration.name(), self.rate.name())
    }
}

impl FromStr for Units {
    type Err = OptionProblem;

    /// Reads one or two units, separated by a comma, in any order: `m/s2` or `g`, `rad/s` or `dps`, also `m/s^2`,
    /// `m/s²`, `deg/s` or `°/s`.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let (mut acceleration, mut rate) = (None, None);
        for unit in text.split(',').map(str::trim) {
            let twice = match (AccelerationUnit::written(unit), RateUnit::written(unit)) {
                (Some(unit), _) => acceleration.replace(unit).is_some(),
                (None, Some(unit)) => rate.replace(unit).is_some(),
                (None, None) => return Err(OptionProblem::UnknownUnit(unit.to_owned())),
            };
            if twice {
                return Err(OptionProblem::TwoUnits(text.to_owned()));
            }
        }
        Ok(Self { acceleration: acceleration.unwrap_or_default(), rate: rate.unwrap_or_default() })
    }
}

crate::named! {
    /// Unit of a table's times.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TimeUnit {
        /// s.
        #[default]
        Seconds = "s",
        /// ms.
        Milliseconds = "ms",
        /// µs.
        Microseconds = "us",
        /// ns.
        Nanoseconds = "ns",
    } or |name| format!("{name:?} is not a unit of time: write s, ms, us or ns")
}

impl TimeUnit {
    /// The unit with this spelling.
    pub(super) fn written(text: &str) -> Option<Self> {
        Self::of_name(match text {
            "sec" => "s",
            "µs" | "μs" => "us",
            name => name,
        })
    }

    /// Name of the unit in a sentence.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }

    /// Number of units per second.
    #[must_use]
    pub const fn per_second(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1.0e3,
            Self::Microseconds => 1.0e6,
            Self::Nanoseconds => 1.0e9,
        }
    }
}

crate::named! {
    /// Treatment of times that are not in order.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Times {
        /// Times are kept unchanged. A time that does not advance is an error.
        #[default]
        Keep = "keep",
        /// The fewest possible rows are left out so that times advance: duplicates, steps back, single rows far ahead.
        DropBad = "drop-bad",
        /// Between gaps rows are spaced as their samples were, for stamps that jitter; gaps are kept.
        Smooth = "smooth",
        /// Rows are spaced by the sample rate, for rows that arrive in batches; gaps are closed.
        Rate = "rate",
    } or |name| format!("invalid {name:?}: expected keep, drop-bad, smooth or rate")
}

/// Our names other than axes.
const OTHERS: [&str; 4] = ["t", "force", "label", "validity"];

/// Our name that equals this one.
fn own_name(name: &str) -> Option<&'static str> {
    let axes = Axis::ALL.map(Axis::name);
    axes.into_iter().chain(OTHERS).find(|ours| *ours == name)
}

/// Returns whether a column of a `csv` may have this name.
pub(super) fn is_ours(name: &str) -> bool {
    own_name(name).is_some()
}

/// Returns whether this is the name of an axis.
pub(super) fn is_axis(name: &str) -> bool {
    Axis::ALL.iter().any(|axis| axis.name() == name)
}

/// Columns of a file by our names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// Pairs of our name and that of the file.
    pub(super) columns: Vec<(&'static str, String)>,
}

impl Mapping {
    /// Pairs of our name and that of the file.
    pub fn pairs(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.columns.iter().map(|(ours, theirs)| (*ours, theirs.as_str()))
    }

    /// Returns whether the mapping is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }
}

impl FromStr for Mapping {
    type Err = OptionProblem;

    /// Reads `ours=theirs` pairs, separated by commas.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let mut columns: Vec<(&'static str, String)> = Vec::new();
        for pair in text.split(',') {
            let Some((ours, theirs)) = pair.split_once('=') else {
                return Err(OptionProblem::NotAPair(pair.to_owned()));
            };
            let (ours, theirs) = (ours.trim(), theirs.trim());
            let unknown = || OptionProblem::UnknownColumn(ours.to_owned());
            let ours = own_name(ours).ok_or_else(unknown)?;
            if columns.iter().any(|(named, _)| *named == ours) {
                return Err(OptionProblem::MappedTwice(ours));
            }
            if columns.iter().any(|(_, named)| named == theirs) {
                return Err(OptionProblem::TakenTwice(theirs.to_owned()));
            }
            columns.push((ours, theirs.to_owned()));
        }
        Ok(Self { columns })
    }
}

impl fmt::Display for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (ours, theirs)) in self.pairs().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            write!(f, "{comma}{ours}={theirs}")?;
        }
        Ok(())
    }
}

/// Options of a bag. The default reads its only IMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagOptions {
    /// Topics of the feet.
    pub topics: Topics,
    /// Topics that are left out; `*` matches any text.
    pub excluded: Vec<String>,
    /// Frames (`header.frame_id`) of the feet, if one topic has those of several; empty for all.
    pub frames: Vec<String>,
    /// Topics of their loads, in the same order: empty, one for each foot, or a single one in which `{foot}` is
    /// replaced by the name of each.
    pub loads: Vec<LoadTopic>,
    /// Other names of feet.
    pub renames: Vec<Rename>,
}

impl BagOptions {
    /// Returns whether a topic is excluded.
    #[must_use]
    pub fn excludes(&self, topic: &str) -> bool {
        self.excluded.iter().any(|pattern| matches_pattern(&absolute(pattern), topic))
    }
}

/// Returns whether a name matches a pattern, in which `*` matches any text.
#[must_use]
pub fn matches_pattern(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else {
        return false;
    };
    let mut last = None;
    for part in parts {
        if let Some(between) = last.replace(part) {
            match rest.find(between) {
                Some(at) => rest = &rest[at + between.len()..],
                None => return false,
            }
        }
    }
    last.map_or(rest.is_empty(), |last| rest.ends_with(last))
}

/// Selects all topics with samples of an IMU.
const ALL: &str = "all";

/// Selection of the topics of feet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Topics {
    /// The only topic with samples of an IMU; several are an error.
    #[default]
    TheOnly,
    /// These topics, in this order.
    Named(Vec<String>),
    /// All topics with samples of an IMU, by name.
    All,
}

impl Topics {
    /// Topics given in options; `all` selects all.
    #[must_use]
    pub fn from_names(names: &[String]) -> Self {
        if names.is_empty() {
            Self::TheOnly
        } else if names.iter().any(|name| name == ALL) {
            Self::All
        } else {
            let mut named: Vec<String> = Vec::new();
            for name in names.iter().map(|name| absolute(name)) {
                if !named.contains(&name) {
                    named.push(name);
                }
            }
            Self::Named(named)
        }
    }
}

/// Placeholder for the name of the foot in a [`LoadTopic`].
const FOOT: &str = "{foot}";

/// Topic of the load of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadTopic {
    /// Name of the topic.
    pub topic: String,
    /// Field of its messages, if not the default.
    pub field: Option<String>,
}

impl FromStr for LoadTopic {
    type Err = OptionProblem;

    /// Reads `TOPIC`, `TOPIC:FIELD` or `TOPIC.FIELD`: topics of ROS have no dot.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let split = text.split_once(':').or_else(|| text.split_once('.'));
        let (topic, field) = match split {
            Some((topic, field)) => (topic, Some(field)),
            None => (text, None),
        };
        if topic.is_empty() || field == Some("") {
            return Err(OptionProblem::LoadTopic(text.to_owned()));
        }
        Ok(Self { topic: absolute(topic), field: field.map(str::to_owned) })
    }
}

impl LoadTopic {
    /// Returns whether the topic depends on the foot.
    #[must_use]
    pub fn is_pattern(&self) -> bool {
        let field = self.field.as_deref().unwrap_or_default();
        self.topic.contains(FOOT) || field.contains(FOOT)
    }

    /// Returns the load of the foot with this name.
    #[must_use]
    pub fn of_foot(&self, name: &str) -> Self {
        let field = self.field.as_ref();
        Self {
            topic: self.topic.replace(FOOT, name),
            field: field.map(|field| field.replace(FOOT, name)),
        }
    }
}

impl fmt::Display for LoadTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.field {
            Some(field) => write!(f, "{}:{field}", self.topic),
            None => f.write_str(&self.topic),
        }
    }
}

/// Another name of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rename {
    /// Name of the foot, its topic, or a part of its topic.
    pub old: String,
    /// The name that it gets.
    pub new: String,
}

impl FromStr for Rename {
    type Err = OptionProblem;

    /// Reads `OLD=NEW`.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        match text.split_once('=') {
            Some((old, new)) if !old.is_empty() && !new.is_empty() => {
                Ok(Self { old: old.to_owned(), new: new.to_owned() })
            }
            _ => Err(OptionProblem::Rename(text.to_owned())),
        }
    }
}

/// Absolute name of a topic, as in a bag.
fn absolute(name: &str) -> String {
    if name.starts_with('/') { name.to_owned() } else { format!("/{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_in_any_order_and_default_to_si() {
        let g_dps = Units {
            acceleration: AccelerationUnit::StandardGravity,
            rate: RateUnit::DegreesPerSecond,
        };
        assert_eq!("g,dps".parse(), Ok(g_dps));
        assert_eq!("dps, g".parse(), Ok(g_dps));
        assert_eq!("m/s2,rad/s".parse(), Ok(Units::default()));
        assert_eq!(
            "m/s^2,°/s".parse::<Units>().map(|units| units.to_string()),
            Ok("m/s2,dps".to_owned())
        );
        assert_eq!(g_dps.to_string(), "g,dps");
        let g = Units { acceleration: AccelerationUnit::StandardGravity, ..Units::default() };
        assert_eq!("g".parse(), Ok(g));
        for wrong in ["", "g,g", "g,m/s2", "mph"] {
            assert!(wrong.parse::<Units>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn units_are_known_by_their_usual_spellings() {
        for text in ["m/s^2", "m / s²", "M/S/S", "meters/second^2", "m/sec2", "m s^-2"] {
            let si = AccelerationUnit::MetresPerSecondSquared;
            assert_eq!(AccelerationUnit::written(text), Some(si), "{text}");
        }
        for text in ["dps", "deg/s", "°/s", "Degrees/Second", "degrees per second", "DEG/SEC"] {
            assert_eq!(RateUnit::written(text), Some(RateUnit::DegreesPerSecond), "{text}");
        }
        for text in ["rad/s", "Rad/Sec", "radians/s", "radians per second"] {
            assert_eq!(RateUnit::written(text), Some(RateUnit::RadiansPerSecond), "{text}");
        }
        assert_eq!(RateUnit::written("left foot"), None);
    }

    #[test]
    fn counts_are_scaled_before_their_units_apply() {
        let options = TableOptions {
            scale: "0.5,2".parse().unwrap(),
            units: "mg,mdps".parse().unwrap(),
            ..TableOptions::default()
        };
        let [ax, .., wz] = options.to_si([2000.0, 0.0, 0.0, 0.0, 0.0, 90_000.0]);
        assert_eq!(ax, f64::from(STANDARD_GRAVITY));
        assert_eq!(wz, std::f64::consts::PI);
        assert_eq!(options.scale.to_string().parse(), Ok(options.scale));
        let with_load: Scale = "1,1,-9.8".parse().unwrap();
        assert_eq!((with_load.load, with_load.to_string().parse()), (-9.8, Ok(with_load)));
        for wrong in ["", "1", "1,0", "nan,1", "1,inf", "1,2,0", "1,2,3,4"] {
            assert!(wrong.parse::<Scale>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn g_and_degrees_become_si_and_si_is_unchanged() {
        let readings = [1.0, 0.1, -2.0, 180.0, 0.3, -90.0];
        let [ax, .., wx, _, _] = "g,dps".parse::<Units>().unwrap().to_si(readings);
        assert_eq!(ax, f64::from(STANDARD_GRAVITY));
        assert_eq!(wx, std::f64::consts::PI);
        assert_eq!(Units::default().to_si(readings), readings);
    }

    #[test]
    fn unknown_words_error_lists_the_known_ones() {
        assert_eq!("us".parse(), Ok(TimeUnit::Microseconds));
        assert_eq!(
            "min".parse::<TimeUnit>(),
            Err("\"min\" is not a unit of time: write s, ms, us or ns".to_owned())
        );
        assert_eq!("drop-bad".parse(), Ok(Times::DropBad));
        assert!("drop".parse::<Times>().is_err());
    }

    #[test]
    fn mapping_reads_as_it_is_written() {
        let text = "t=stamp,ax=/imu/linear_acceleration/x,force=foot_force[0]";
        let mapping: Mapping = text.parse().unwrap();
        assert_eq!(mapping.to_string(), text);
        assert_eq!(mapping.pairs().next(), Some(("t", "stamp")));
    }

    #[test]
    fn invalid_mapping_is_rejected() {
        for (text, why) in [
            ("ax", "is not a pair"),
            ("", "is not a pair"),
            ("a_x=foo", "there is no column \"a_x\" to map to"),
            ("ax=foo,ax=bar", "ax is mapped twice"),
            ("ax=foo,ay=foo", "column \"foo\" is mapped twice"),
        ] {
            let said = text.parse::<Mapping>().unwrap_err().to_string();
            assert!(said.contains(why), "{said}");
        }
    }

    #[test]
    fn topics_are_absolute_and_unique() {
        let named = |names: &[&str]| {
            Topics::from_names(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(named(&[]), Topics::TheOnly);
        assert_eq!(named(&["all"]), Topics::All);
        let both = Topics::Named(vec!["/imu/fl".to_owned(), "/imu/fr".to_owned()]);
        assert_eq!(named(&["imu/fl", "/imu/fr", "/imu/fl"]), both);
    }

    #[test]
    fn excluded_topics_may_have_stars() {
        let bag = |pattern: &str| BagOptions {
            excluded: vec![pattern.to_owned()],
            ..BagOptions::default()
        };
        for (pattern, excluded) in [
            ("/trunk/imu", [true, false, false]),
            ("trunk/imu", [true, false, false]),
            ("/trunk*", [true, true, false]),
            ("*imu", [true, false, true]),
            ("*r*n*u*", [true, true, false]),
            ("/trunk", [false, false, false]),
            ("*", [true, true, true]),
        ] {
            let topics = ["/trunk/imu", "/trunk/imu/raw", "/fl/imu"];
            assert_eq!(topics.map(|topic| bag(pattern).excludes(topic)), excluded, "{pattern}");
        }
        assert!(!bag("/a*a").excludes("/a"));
    }

    #[test]
    fn load_topic_may_depend_on_the_foot() {
        let load: LoadTopic = "/ft/{foot}:force.z".parse().unwrap();
        assert!(load.is_pattern());
        assert_eq!(load.of_foot("fl").to_string(), "/ft/fl:force.z");
        assert!(!load.of_foot("fl").is_pattern());
    }

    #[test]
    fn load_topic_may_have_a_field() {
        let load: LoadTopic = "/ft/fl:force.z".parse().unwrap();
        assert_eq!((load.topic.as_str(), load.field.as_deref()), ("/ft/fl", Some("force.z")));
        assert_eq!(load.to_string(), "/ft/fl:force.z");
        assert_eq!("ft".parse::<LoadTopic>().unwrap().to_string(), "/ft");
        let dotted: LoadTopic = "/lowstate.foot_force[0]".parse().unwrap();
        assert_eq!(dotted.to_string(), "/lowstate:foot_force[0]");
        for wrong in ["", ":force", "/ft:"] {
            assert!(wrong.parse::<LoadTopic>().is_err(), "{wrong}");
        }
    }
}
