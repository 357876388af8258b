//! Hints of errors, findings and notices, and the words of the program that shows them.
//!
//! An error is data: the problem, its position, the values, and a [`Hint`] on the remedy. Most hints name a setting,
//! and each program has its own names for these: `--units g,dps` on a command line, `units="g,dps"` in Python. A
//! [`Vocabulary`] has these names. [`InWords::in_words`] gives the text in the words of a program; `Display` gives it
//! in plain words.

use std::fmt::{self, Display, Formatter};

use estimator_core::Gravity;
use estimator_core::mounting::Mounting;

use samples::mounting::axes_text;

use crate::mapping::Mapping;
use crate::units::{AccelerationUnit, RateUnit, TimeUnit, Units};
use crate::words::{GRAVITIES, word_of};

samples::named! {
    /// A setting of how a recording is read or estimated, by its name in plain words.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Setting {
        /// Mounting of the sensor.
        Axes = "axes",
        /// Configuration file.
        Config = "config",
        /// Mark before the fraction of a number.
        Decimal = "decimal",
        /// Whether recorded contacts are ignored; it has no value.
        EstimateAgain = "estimate again",
        /// Format of the file.
        Format = "format",
        /// Frames of the feet on a topic.
        Frame = "frame",
        /// Whether accelerations contain gravity.
        Gravity = "gravity",
        /// Topics of the loads.
        LoadTopic = "load topic",
        /// Mapping of columns or fields.
        Map = "map",
        /// Topics that are left out.
        NotTopic = "not topic",
        /// Preset of the parameters.
        Preset = "preset",
        /// Other names of feet.
        Rename = "rename",
        /// Samples per second.
        SampleRate = "sample rate",
        /// Factors of readings.
        Scale = "scale",
        /// Unit of times.
        TimeUnit = "time unit",
        /// Treatment of times that are not in order.
        Times = "times",
        /// Topics of the feet.
        Topic = "topic",
        /// Units of readings.
        Units = "units",
        /// Length of the window.
        Window = "window",
    }
}

/// Names of settings in a program.
pub trait Vocabulary: Sync {
    /// Name of a setting, such as `--units`.
    fn name(&self, setting: Setting) -> String;

    /// A setting with a value, such as `--units g,dps`.
    fn set(&self, setting: Setting, value: &dyn Display) -> String;

    /// Returns the remedy in words of this program, if the program has a command for it, or lacks the settings that
    /// the hint names. `None` uses the common words.
    fn remedy(&self, _hint: &Hint) -> Option<String> {
        None
    }
}

/// Plain words of no particular program: `units g,dps`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Plain;

impl Vocabulary for Plain {
    fn name(&self, setting: Setting) -> String {
        setting.to_string()
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        format!("{setting} {value}")
    }
}

/// Words for tests, in which settings are marked: `[units] g,dps`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bracketed;

impl Vocabulary for Bracketed {
    fn name(&self, setting: Setting) -> String {
        format!("[{setting}]")
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        format!("[{setting}] {value}")
    }
}

/// An error, finding or notice that may name settings.
pub trait InWords {
    /// Writes the text in the words of a program.
    ///
    /// # Errors
    /// The error of the formatter.
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result;

    /// Returns the text in the words of a program.
    fn in_words(&self, words: &dyn Vocabulary) -> String
    where
        Self: Sized,
    {
        Worded { what: self, words }.to_string()
    }
}

struct Worded<'a, S> {
    what: &'a S,
    words: &'a dyn Vocabulary,
}

impl<S: InWords> Display for Worded<'_, S> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.what.write_in(self.words, f)
    }
}

/// Implements `Display` in plain words for types that implement [`InWords`].
#[macro_export]
macro_rules! display_in_plain_words {
    ($($type:ty),+) => {
        $(impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                $crate::hint::InWords::write_in(self, &$crate::hint::Plain, f)
            }
        })+
    };
}

/// Remedy for an error, a finding or a notice. The text is a clause without punctuation around it.
#[derive(Clone, Debug, PartialEq)]
pub enum Hint {
    /// The axes of a table are in these units.
    Units(Units),
    /// Accelerations are in this unit.
    AccelerationUnit(AccelerationUnit),
    /// Rates are in this unit.
    RateUnit(RateUnit),
    /// Rates are in °/s or in revolutions per minute.
    DegreesOrRevolutions,
    /// Rates are in another unit, or counts.
    OtherRateUnit,
    /// Accelerations are in another unit, or counts.
    OtherUnit,
    /// There is a line of units below the header.
    UnitsLine,
    /// A header follows rows of data.
    SecondHeader,
    /// Units or gravity may be wrong: half a sentence.
    UnitsAndGravity,
    /// Times are in this unit.
    TimeUnit(TimeUnit),
    /// Times are in another unit.
    OtherTimeUnit,
    /// The column `t`, which is read in s, looks like this unit.
    TimesLookLike(TimeUnit),
    /// The column `t` may be in each of these units, in which it gives these rates, Hz.
    TimesLookLikeOneOf(Vec<(TimeUnit, f64)>),
    /// A number has a comma before its fraction.
    DecimalComma,
    /// A date is not in the form of ISO 8601.
    DateForm,
    /// Rows are not in order.
    RowOrder,
    /// Messages are not in order.
    MessageOrder,
    /// Times jitter.
    SmoothTimes,
    /// Times were smoothed.
    KeepTimes,
    /// Readings of several feet are mixed.
    SplitFeet,
    /// Rows arrive in batches.
    Batches,
    /// Rows are spaced by the sample rate.
    SpaceRows,
    /// Samples are missing, or rows arrive in batches.
    MissingSamples,
    /// The file needs one of the formats of tables without names.
    Format,
    /// The sample rate is not known.
    SampleRate,
    /// The known names of a header are in upper case.
    LowerCase,
    /// The lines end in a carriage return without a line feed.
    LineEnds,
    /// The known names of a header are separated by this character.
    Separator(char),
    /// Mapping that may be intended.
    Map(Mapping),
    /// Column that may be the times.
    MapTime(String),
    /// Mapping of the first names of a header, as an example.
    MapExample(Mapping),
    /// Mapping of each of several sensors.
    ChooseSensor(Vec<Mapping>),
    /// The load crosses these thresholds, which are in the unit of the load.
    LoadThresholds {
        /// Upper threshold.
        on: f32,
        /// Lower threshold.
        off: f32,
    },
    /// This topic can be left out.
    LeaveOut(String),
    /// Columns are exchanged by this mapping.
    ExchangeColumns(String),
    /// The sign of the angular rates is to be changed.
    TurnRatesAround,
    /// The sign of the load is to be changed.
    TurnLoadAround,
    /// The six axes of a message are to be named.
    MapFields,
    /// The part of a message is the IMU of the trunk; this is its address.
    ReadTrunk(String),
    /// A message on this topic has six axes.
    TopicWithAxes(String),
    /// One of several IMUs is to be chosen, by these settings.
    ChooseTopic {
        /// Whether their topics differ.
        topics: bool,
        /// Whether a topic has several frames.
        frames: bool,
    },
    /// A load is to be given for each of these feet.
    LoadForEach(String),
    /// The topics of feet are to be named in the order of their loads.
    TopicsInOrder,
    /// Each foot gets a name of its own.
    Rename,
    /// The file ends early, so that other readers refuse it.
    WholeCopy,
    /// Contacts were used as they were recorded.
    EstimateAgain,
    /// Contacts are used as they were recorded, although the estimate could be computed.
    EstimateFromSamples,
    /// Gravity is as given here.
    Gravity(Gravity),
    /// The sensor lies like this in the foot.
    Axes(Mounting),
    /// A window of this length has the same duration, ms.
    Window(f64),
    /// The preset and its method are to be left out.
    SelfCalibrating,
}

impl InWords for Hint {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        if let Some(own) = words.remedy(self) {
            return f.write_str(&own);
        }
        let name = |setting| words.name(setting);
        let times = |value: &str| words.set(Setting::Times, &value);
        match self {
            Self::Units(units) => f.write_str(&words.set(Setting::Units, units)),
            Self::AccelerationUnit(unit) => f.write_str(&words.set(Setting::Units, unit)),
            Self::RateUnit(unit) => f.write_str(&words.set(Setting::Units, unit)),
            Self::DegreesOrRevolutions => write!(
                f,
                "{} or {}",
                words.set(Setting::Units, &RateUnit::DegreesPerSecond),
                words.set(Setting::Units, &RateUnit::RevolutionsPerMinute)
            ),
            Self::OtherRateUnit => {
                write!(f, "{} gives the value of a count", name(Setting::Scale))
            }
            Self::OtherUnit => write!(
                f,
                "{}, mm/s2, g or mg, or {} with the value of a count",
                words.set(Setting::Units, &"m/s2"),
                name(Setting::Scale)
            ),
            Self::UnitsLine => write!(
                f,
                "take out the line of units, and name them with {} and {}",
                name(Setting::Units),
                name(Setting::TimeUnit)
            ),
            Self::SecondHeader => {
                f.write_str("the header is repeated here, as in a file made of two tables")
            }
            Self::UnitsAndGravity => {
                write!(f, "check the units and {}", name(Setting::Gravity))
            }
            Self::TimeUnit(unit) => f.write_str(&words.set(Setting::TimeUnit, unit)),
            Self::OtherTimeUnit => {
                write!(f, "{} gives the unit: s, ms, 100us, us or ns", name(Setting::TimeUnit))
            }
            Self::TimesLookLike(unit) => write!(
                f,
                "column t looks like {}, but is read in s: {}",
                unit.words(),
                words.set(Setting::TimeUnit, unit)
            ),
            Self::TimesLookLikeOneOf(units) => {
                let each = units.iter().map(|(unit, rate)| {
                    let option = words.set(Setting::TimeUnit, unit);
                    format!("in {} it gives {rate:.0} Hz: {option}", unit.words())
                });
                write!(f, "column t may be in another unit: {}", each.collect::<Vec<_>>().join("; "))
            }
            Self::DecimalComma => write!(
                f,
                "a comma before the fraction, not between thousands, is read with {}",
                words.set(Setting::Decimal, &',')
            ),
            Self::DateForm => f.write_str("a date is read in the form 2026-11-30 12:00:00.123"),
            Self::RowOrder => write!(
                f,
                "sort the rows, leave such rows out with {}, or smooth times that jitter with {}",
                times("drop-bad"),
                times("smooth")
            ),
            Self::MessageOrder => write!(
                f,
                "{} leaves such messages out, {} smooths times that jitter",
                times("drop-bad"),
                times("smooth")
            ),
            Self::SmoothTimes => write!(f, "{} keeps all rows", times("smooth")),
            Self::KeepTimes => write!(f, "{} reads them as they are", times("keep")),
            Self::SplitFeet => write!(
                f,
                "{} splits a table by the column that names the foot; in a bag, give each foot a topic or a frame of its own",
                words.set(Setting::Map, &"foot=COLUMN")
            ),
            Self::Batches => {
                write!(f, "rows that arrive in batches are spaced by {}", times("rate"))
            }
            Self::SpaceRows => f.write_str(&times("rate")),
            Self::MissingSamples => write!(f, "samples are missing, or {}", times("rate")),
            Self::Format => {
                write!(f, "{}, pce-go1, lcd or csv", words.set(Setting::Format, &"pce-atlas"))
            }
            Self::SampleRate => f.write_str(&words.set(Setting::SampleRate, &"HZ")),
            Self::LowerCase => f.write_str("names are written in lower case"),
            Self::LineEnds => f.write_str(
                "lines end in a carriage return alone: save the table with line feeds, such as with tr '\\r' '\\n'",
            ),
            Self::Separator(found) => {
                write!(f, "columns are separated by commas, semicolons or tabs, not by {found:?}")
            }
            Self::Map(mapping) => {
                write!(f, "did you mean {}?", words.set(Setting::Map, mapping))
            }
            Self::MapTime(column) => {
                let mapping = format!("t={column}");
                write!(f, "did you mean `t` for `{column}`? {}", words.set(Setting::Map, &mapping))
            }
            Self::MapExample(mapping) => write!(
                f,
                "{} gives the columns for them, such as {}",
                name(Setting::Map),
                words.set(Setting::Map, mapping)
            ),
            Self::ChooseSensor(mappings) => {
                let each = mappings.iter().map(|mapping| words.set(Setting::Map, mapping));
                write!(f, "choose one, {}", each.collect::<Vec<_>>().join(" or "))
            }
            Self::LoadThresholds { on, off } => write!(
                f,
                "on_threshold = {on} and off_threshold = {off} in the table [load] of {}",
                name(Setting::Config)
            ),
            Self::LeaveOut(topic) => {
                write!(f, "{} leaves it out", words.set(Setting::NotTopic, topic))
            }
            Self::ExchangeColumns(mapping) => f.write_str(&words.set(Setting::Map, mapping)),
            Self::TurnRatesAround => write!(
                f,
                "one axis has the wrong sign, or two are exchanged; {} repairs it",
                words.set(Setting::Scale, &"1,-1")
            ),
            Self::TurnLoadAround => {
                write!(f, "{} turns its sign", words.set(Setting::Scale, &"1,1,-1"))
            }
            Self::MapFields => write!(
                f,
                "{} names the six axes, such as ax=imu.accelerometer[0]",
                name(Setting::Map)
            ),
            Self::ReadTrunk(address) => {
                write!(f, "{} reads it anyway", words.set(Setting::Topic, address))
            }
            Self::TopicWithAxes(topic) => write!(
                f,
                "{topic} has six axes, of a foot or of the trunk: {}",
                words.set(Setting::Topic, topic)
            ),
            Self::ChooseTopic { topics, frames } => {
                let (topic, frame) = (name(Setting::Topic), name(Setting::Frame));
                let one = match (topics, frames) {
                    (true, true) => format!("{topic} and {frame}"),
                    (false, true) => frame,
                    (_, false) => topic,
                };
                write!(f, "choose with {one}, or {}", words.set(Setting::Topic, &"all"))
            }
            Self::LoadForEach(feet) => {
                write!(f, "give {} once for each of {feet}", name(Setting::LoadTopic))
            }
            Self::TopicsInOrder => write!(
                f,
                "name the feet with {}, in the order of their {}",
                name(Setting::Topic),
                name(Setting::LoadTopic)
            ),
            Self::Rename => {
                write!(f, "{} gives each foot a name of its own", name(Setting::Rename))
            }
            Self::WholeCopy => {
                f.write_str("for readers that refuse such a file, a converted copy is whole")
            }
            Self::EstimateAgain => f.write_str(&name(Setting::EstimateAgain)),
            Self::EstimateFromSamples => {
                write!(f, "{} computes the estimate from the samples", name(Setting::EstimateAgain))
            }
            Self::Gravity(gravity) => {
                f.write_str(&words.set(Setting::Gravity, &word_of(&GRAVITIES, *gravity)))
            }
            Self::Axes(axes) => f.write_str(&words.set(Setting::Axes, &axes_text(axes))),
            Self::Window(ms) => {
                let window = words.set(Setting::Window, &format!("{ms:.0}ms"));
                write!(f, "{window} has the same duration")
            }
            Self::SelfCalibrating => write!(
                f,
                "leave out {}, or set method = \"self_calibrating\" in the configuration",
                words.set(Setting::Preset, &"paper")
            ),
        }
    }
}

/// A sentence about something that was left out or reinterpreted, for people to read.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// The sentence, without the hint.
    pub text: String,
    /// Remedy, if there is one.
    pub hint: Option<Hint>,
}

impl Notice {
    /// Creates a notice with a hint.
    #[must_use]
    pub const fn with_hint(text: String, hint: Hint) -> Self {
        Self { text, hint: Some(hint) }
    }
}

impl From<String> for Notice {
    fn from(text: String) -> Self {
        Self { text, hint: None }
    }
}

impl InWords for Notice {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)?;
        match &self.hint {
            Some(hint) => {
                f.write_str(": ")?;
                hint.write_in(words, f)
            }
            None => Ok(()),
        }
    }
}

display_in_plain_words!(Hint, Notice);
