//! Options that commands share.
//!
//! | options | type | commands |
//! |---|---|---|
//! | reading of recordings, and the parameters of their estimates | [`RecordingArguments`] | `replay`, `calibrate` |
//! | reading of recordings: format, mounting, tables, bags | [`ReadingArguments`] and the types in it | the same, and `convert` |
//! | sources of streaming feet, and nodes that are feet | [`ListenArguments`] | `monitor`, `record`, `ros2` |
//! | nodes that are feet, alone | [`FeetArguments`] | the same, `view` and `decode` |
//! | reading and estimate of a recording that is played as a source, or of samples on topics | [`PlayedArguments`] | `monitor`, `record`, `ros2`, `view` |
//! | loads of feet on topics, and the domain of the topics | [`TopicArguments`] | the same, and `calibrate` |
//! | replacing of files | [`OverwriteArguments`] | those that write a file |
//! | the options that are given, by their names | [`GivenOptions`] | `calibrate` |
//! | frames of messages, and messages of other programs | [`PublishedArguments`] | those that publish |
//!
//! The arguments about a recording reach the library in three steps:
//!
//! 1. clap parses [`RecordingArguments`], [`ReadingArguments`] or [`PlayedArguments`].
//! 2. Their method `resolved`, or `playback`, adds the configuration file. The result, [`Resolved`], keeps preset, file
//!    and options apart, because errors name the source of a setting.
//! 3. [`Resolved::input_options`] gives the [`InputOptions`] to read a file, with the arguments about tables and bags.
//!    [`Resolved::params_of`] gives the [`AnyParams`] of a foot. In both, options override the file, and the file
//!    overrides the preset.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::net::IpAddr;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, FromArgMatches, Id};
use config::{
    ConfigError, ConfigFile, FootAxes, GRAVITIES, Preset, Resolved, parse_gravity,
    parse_sample_rate,
};
use estimator_core::Gravity;
use estimator_core::any::AnyParams;
use estimator_core::half_widths::WindowLength;
use estimator_core::mounting::Mounting;
use estimator_core::params::LoadParams;
use feet::Playback;
use feet::decode::KnownFeet;
use feet::decode::known_feet::{Name, NamedFoot, NamedTwice, names_line};
use options::{
    BagOptions, ContactUse, Decimal, Format, InputOptions, LoadTopic, Mapping, Rename, Scale,
    TableOptions, TimeUnit, Times, Topics, Units,
};
use plausible::{self, Finding};
use replay::summary::differences;
use samples::Recording;
use wire::NodeId;

use crate::Source;
use crate::error::{Error, Worded};
use crate::files::Existing;
use crate::messages::{error, warn};
use crate::ros::Compat;
use crate::ros::compat::WRENCH_FORCE;
#[cfg(any(feature = "bags", feature = "foxglove", feature = "ros2"))]
use crate::ros::{AllFeet, Bridge};
use crate::source::{SourceArgument, find_all, text_of};
use crate::topic_source::{FootLoad, RosDomain, VariableError, parse_domain};
use crate::words::in_words;

/// Heading of the options for reading the input.
pub const INPUT: &str = "Input";

/// Heading of the options of the estimator.
pub const ESTIMATOR: &str = "Estimator";

/// Heading of the options for the output.
pub const OUTPUT: &str = "Output";

/// How recordings are read, and the parameters of their estimates. Options override the configuration file, which
/// overrides the preset.
#[derive(Debug, Args)]
pub struct RecordingArguments {
    /// Options for reading the recordings.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Parameters to start from
    #[arg(long, value_parser = preset_parser(), default_value = Preset::default().name(), help_heading = ESTIMATOR)]
    pub preset: Preset,
    /// TOML file with parameters that differ from the preset
    #[arg(long, value_name = "FILE.toml", help_heading = ESTIMATOR)]
    pub config: Option<PathBuf>,
}

impl RecordingArguments {
    /// Merges preset, configuration file and options.
    ///
    /// # Errors
    /// The file cannot be read, or has an error.
    pub(crate) fn resolved(&self, window: Option<WindowLength>) -> Result<Resolved, Error> {
        self.reading.resolved(self.preset, self.config.as_deref(), window)
    }

    /// Returns the preset and the parameters that differ from it, in one line.
    pub(crate) fn parameters_text(&self, params: &AnyParams, format: Format) -> String {
        let preset = self.preset.name();
        match differences(params, self.preset, format).as_str() {
            "" => format!("all parameters are those of the preset {preset}"),
            differences => format!("preset {preset}, but {differences}"),
        }
    }
}

/// How recordings are read.
#[derive(Debug, Args)]
pub struct ReadingArguments {
    /// Format of the input; not needed if a header names the columns (csv) or the first bytes show it
    /// (parquet, mcap, rosbag2, rosbag1)
    #[arg(long, value_parser = name_parser(Format::ALL, Format::name, Format::help), help_heading = INPUT)]
    pub format: Option<Format>,
    /// Sample rate, if the input does not state it or its nominal rate is wrong
    #[arg(long, value_name = "HZ", value_parser = parse_sample_rate, help_heading = INPUT)]
    pub sample_rate: Option<f32>,
    /// Whether the accelerations contain gravity
    #[arg(long, value_parser = word_parser(GRAVITIES.map(|(word, _)| word), parse_gravity), help_heading = INPUT)]
    pub gravity: Option<Gravity>,
    /// How the sensor is mounted.
    #[command(flatten)]
    pub mounting: MountingArguments,
    /// How tables are read.
    #[command(flatten)]
    pub table: TableArguments,
    /// Topics of a bag that are read.
    #[command(flatten)]
    pub bag: BagArguments,
    /// Fail if a recording is implausible: wrong units, gravity missing or unexpected, a clock that jumps
    #[arg(long, help_heading = INPUT)]
    pub strict: bool,
}

impl ReadingArguments {
    /// Reports the findings of a recording.
    ///
    /// # Errors
    /// There are findings, and `--strict` is given.
    pub(crate) fn report(&self, file: &str, findings: &[Finding]) -> Result<(), Error> {
        for finding in findings {
            let message = format!("{file}: {}", in_words(finding));
            // With `--strict` findings are errors, as the failure refers to them.
            if self.strict {
                error(message);
            } else {
                warn(message);
            }
        }
        if self.strict && !findings.is_empty() {
            return Err(Implausible { file: file.to_owned(), count: findings.len() }.into());
        }
        Ok(())
    }

    /// Merges these options and `window` with a preset and a configuration file.
    ///
    /// # Errors
    /// The file cannot be read, or has an error.
    pub(crate) fn resolved(
        &self,
        preset: Preset,
        config: Option<&Path>,
        window: Option<WindowLength>,
    ) -> Result<Resolved, Error> {
        let from_file = config.map(read_config).transpose()?.unwrap_or_default();
        Ok(Resolved {
            preset,
            window,
            sample_rate: self.sample_rate,
            gravity: self.gravity,
            axes: self.mounting.axes.clone(),
            ..from_file
        })
    }

    /// Returns the properties of the files that their format does not define.
    pub(crate) fn input_options(&self, resolved: &Resolved, contacts: ContactUse) -> InputOptions {
        resolved.input_options(self.table.options(), self.bag.options(), contacts)
    }
}

/// A recording is implausible and `--strict` is given.
#[derive(Debug, thiserror::Error)]
#[error("{file}: --strict rejects {count} of the findings above")]
struct Implausible {
    /// Recording as given.
    file: String,
    /// Number of findings.
    count: usize,
}

impl Worded for Implausible {}

/// How the sensor is mounted in the foot.
#[derive(Clone, Debug, Default, Args)]
pub struct MountingArguments {
    /// Mounting, if given.
    #[arg(
        long,
        value_name = "[FOOT=]x,-z,y|w,x,y,z",
        help_heading = INPUT,
        allow_hyphen_values = true,
        help = "Mounting of the sensor: its axes along the foot's x, y and z (up), or a unit \
                quaternion from the sensor's frame to the foot's; or one of these for each foot: \
                FL=x,y,z,FR=-x,-y,z. footfall calibrate finds it"
    )]
    pub axes: Option<FootAxes>,
}

/// How tables are read whose layout is not recognised; docs/reference/formats.md lists the layouts that are.
#[derive(Clone, Debug, Default, Args)]
pub struct TableArguments {
    /// Columns of the table by the names that they have here.
    #[arg(
        long,
        value_name = "OURS=THEIRS,...",
        help_heading = INPUT,
        help = "Columns to read, by their names or the last parts of their names, such as \
                t=stamp,ax=linear_acceleration.x; the names of ROS, PlotJuggler and Unitree are known"
    )]
    pub map: Option<Mapping>,
    /// Units of the six axes if they are not m/s2,rad/s: g, mg or mm/s2, dps, mdps or rpm
    #[arg(long, value_name = "g,dps", help_heading = INPUT)]
    pub units: Option<Units>,
    /// Factors that convert the readings of accelerometer and gyroscope to --units, such as 0.000122,0.07 for
    /// counts; a third factor is for the load, as in 1,1,-1
    #[arg(long, value_name = "A,W[,LOAD]", help_heading = INPUT, allow_hyphen_values = true)]
    pub scale: Option<Scale>,
    /// Decimal mark of a table's numbers, such as the comma in 1,5
    #[arg(long, value_name = "MARK", value_parser = word_parser([".", ","], str::parse::<Decimal>), hide_possible_values = true, help_heading = INPUT)]
    pub decimal: Option<Decimal>,
    /// Unit of the times, if the column's name does not give it and it is not s
    #[arg(long, value_parser = word_parser(TimeUnit::ALL.map(TimeUnit::name), str::parse::<TimeUnit>), help_heading = INPUT)]
    pub time_unit: Option<TimeUnit>,
    /// Treatment of times: auto (smooth times that jitter without gaps), keep (as they are), drop-bad (omit rows that do
    /// not advance), smooth (space rows evenly between gaps) or rate (space all rows by the sample rate)
    #[arg(long, value_parser = word_parser(Times::ALL.map(Times::name), str::parse::<Times>), hide_possible_values = true, help_heading = INPUT)]
    pub times: Option<Times>,
}

impl TableArguments {
    pub(crate) fn options(&self) -> TableOptions {
        TableOptions {
            mapping: self.map.clone().unwrap_or_default(),
            units: self.units.unwrap_or_default(),
            scale: self.scale.unwrap_or_default(),
            decimal: self.decimal.unwrap_or_default(),
            time_unit: self.time_unit,
            times: self.times.unwrap_or_default(),
        }
    }
}

/// Topics of a bag that are read.
#[derive(Clone, Debug, Default, Args)]
pub struct BagArguments {
    /// Topics of the feet.
    #[arg(
        long,
        value_name = "TOPIC|all",
        value_delimiter = ',',
        help_heading = INPUT,
        help = "Topic of a foot, of sensor_msgs/msg/Imu; repeat it for several feet, or write all. Not \
                needed if topics and frames show only one foot"
    )]
    pub topic: Vec<String>,
    /// Topics that are omitted.
    #[arg(
        long,
        value_name = "TOPIC",
        value_delimiter = ',',
        help_heading = INPUT,
        help = "Topic to omit, such as /trunk/imu with --topic all; * matches any text"
    )]
    pub not_topic: Vec<String>,
    /// Frames of the feet.
    #[arg(
        long,
        value_name = "FRAME",
        value_delimiter = ',',
        help_heading = INPUT,
        help = "Frame (header.frame_id) of a foot, if one topic has several; may be repeated. By \
                default each frame is a foot"
    )]
    pub frame: Vec<String>,
    /// Topics of the loads.
    #[arg(
        long,
        value_name = "TOPIC[:FIELD]",
        value_delimiter = ',',
        help_heading = INPUT,
        help = "Load of a foot: Float32, Float64, one of their MultiArrays, Wrench or WrenchStamped, \
                such as /foot/wrench:force.z, or a number in any message, such as \
                /lowstate:foot_force[0]; once for each foot, in the order of the feet, or once with \
                {foot} in place of the foot's name"
    )]
    pub load_topic: Vec<LoadTopic>,
    /// Other names of feet.
    #[arg(
        long,
        value_name = "OLD=NEW",
        value_delimiter = ',',
        help_heading = INPUT,
        help = "Rename a foot of a bag, such as leg_1=FL; OLD is its name, its topic or a part of its \
                topic"
    )]
    pub rename: Vec<Rename>,
}

impl BagArguments {
    /// Returns whether the feet of several topics or frames may be read.
    pub(crate) fn may_be_of_several_feet(&self) -> bool {
        self.topic.len() > 1
            || self.frame.len() > 1
            || Topics::from_names(&self.topic) == Topics::All
    }

    pub(crate) fn options(&self) -> BagOptions {
        BagOptions {
            topics: Topics::from_names(&self.topic),
            excluded: self.not_topic.clone(),
            frames: self.frame.clone(),
            loads: self.load_topic.clone(),
            renames: self.rename.clone(),
        }
    }
}

/// Two recordings of a robot have the same foot.
#[derive(Debug, thiserror::Error)]
#[error(
    "{name} is in both {} and {}, but a robot has each foot once; convert one of them with --rename {name}=OTHER first", files[0], files[1]
)]
pub(crate) struct FootTwice {
    /// Name of the foot.
    pub(crate) name: String,
    /// The recordings.
    pub(crate) files: [String; 2],
}

impl Worded for FootTwice {}

/// Adjusts findings of a recording that was read with this mounting, so that suggested axes replace it.
pub(crate) fn with_mounting(findings: Vec<Finding>, mounting: &Mounting) -> Vec<Finding> {
    let adjusted = |finding: Finding| finding.with_mounting(mounting);
    findings.into_iter().map(adjusted).collect()
}

/// Returns the findings of a recording of `foot` that was read with `input_options`.
pub(crate) fn check(
    recording: &Recording,
    foot: &str,
    input_options: &InputOptions,
    thresholds: Option<LoadParams>,
) -> Vec<Finding> {
    let findings = match thresholds {
        Some(thresholds) => plausible::check_with_load(recording, thresholds),
        None => plausible::check(recording),
    };
    with_mounting(findings, &input_options.correction_of(&[foot]).mounting)
}

/// Reads the settings of a configuration file. It is read once, so it may be a pipe.
///
/// # Errors
/// The file cannot be read, or has an error.
pub(crate) fn read_config(path: &Path) -> Result<Resolved, ConfigError> {
    let name = path.display().to_string();
    match fs::read_to_string(path) {
        Ok(text) => Resolved::of_file(ConfigFile { name, text }),
        Err(source) => Err(ConfigError::Unreadable { file: name, source }),
    }
}

/// Place of a finding: a file, and the foot in it if it has a name.
pub(crate) fn place(file: &str, foot: Option<&str>) -> String {
    foot.map_or_else(|| file.to_owned(), |foot| format!("{file}, foot {foot}"))
}

/// Builds the help text on the syntax of sources from its beginning, up to the forms of `usb`, and the sources that not
/// all commands accept.
macro_rules! help_of_sources {
    ($beginning:literal $(, $further:literal)*) => {
        concat!(
            $beginning,
            ", uart:/dev/ttyACM0[@BAUD], can:can0, slcan:/dev/ttyACM0[@KBIT], ",
            $($further, ", ",)*
            "or demo[:feet=4] for simulated feet"
        )
    };
}

/// Help text on the syntax of several sources.
pub(crate) const HELP_OF_SOURCES: &str = help_of_sources!(
    "Sources of the feet, which are one robot: usb for all feet on USB, usb:FR or usb:SERIAL for one of them",
    "ros2:FL=/lf_foot/imu or ros2:/*/imu for topics of IMUs",
    "file:can.log[@SPEED]"
);

/// Help text on the syntax of several sources whose boards are measured one after the other.
pub(crate) const HELP_OF_BOARDS: &str = help_of_sources!(
    "Sources of the boards, which are measured one after the other: usb for all feet on USB, usb:FR or usb:SERIAL for one of them"
);

/// Help text on the syntax of a single source.
pub(crate) const HELP_OF_ONE_SOURCE: &str =
    help_of_sources!("Source of the foot: usb, usb:FR or usb:SERIAL for one of several");

/// Feet that stream, and their sources.
#[derive(Debug, Args)]
pub struct ListenArguments {
    /// Sources of the feet.
    #[arg(value_name = "SOURCE", help = HELP_OF_SOURCES, default_value = "usb")]
    pub sources: Vec<SourceArgument>,
    /// Nodes that are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// How a played recording of an IMU is read.
    #[command(flatten)]
    pub played: PlayedArguments,
    /// Loads on topics, and their domain.
    #[command(flatten)]
    pub topics: TopicArguments,
}

/// Loads of feet on topics of ROS 2, and the domain of the topics.
#[derive(Clone, Debug, Default, Args)]
pub struct TopicArguments {
    /// Topics of the loads.
    #[arg(
        long = "load",
        value_name = "FOOT=TOPIC[:FIELD]",
        help_heading = INPUT,
        help = "Load of a foot on a topic, with ros2:TOPIC as the source: Float32, Float64, one of their MultiArrays, \
                Wrench or WrenchStamped, or a number in any message, such as FL=/lowstate:foot_force[1]; once for each \
                foot, or once with {foot} in place of its name"
    )]
    pub loads: Vec<FootLoad>,
    /// Domain of DDS, 0 to 232.
    #[arg(
        long,
        value_name = "ID",
        value_parser = parse_domain,
        help = "DDS domain, 0 to 232; by default that of the variable ROS_DOMAIN_ID, or 0"
    )]
    pub domain_id: Option<u16>,
    /// The addresses of the interfaces that are used.
    #[arg(
        long,
        value_name = "ADDRESS",
        help = "Use only the interface with this address, such as 127.0.0.1; may be repeated. \
                ROS_LOCALHOST_ONLY=1 and ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST mean 127.0.0.1"
    )]
    pub network: Vec<IpAddr>,
}

impl TopicArguments {
    /// Returns the domain.
    ///
    /// # Errors
    /// The variable of ROS has no domain.
    pub(crate) fn domain(&self) -> Result<RosDomain, VariableError> {
        RosDomain::or_environment(self.domain_id, self.network.clone())
    }

    /// Applies these options to the topics among the sources.
    ///
    /// # Errors
    /// A load is given, and no source is a topic; or the variable of ROS has no domain.
    pub(crate) fn apply(&self, sources: Vec<Source>) -> Result<Vec<Source>, Error> {
        if !sources.iter().any(|source| matches!(source, Source::Topics(_))) {
            return match self.loads.first() {
                Some(_) => Err(LoadOfNoTopic(text_of(&sources)).into()),
                None => Ok(sources),
            };
        }
        let domain = self.domain()?;
        let applied = sources.into_iter().map(|source| source.with_topics(&domain, &self.loads));
        Ok(applied.collect())
    }
}

/// Loads on topics are given for other sources.
#[derive(Debug, thiserror::Error)]
#[error(
    "{0} has no topics of ROS 2, for which --load names the loads of feet: use ros2:FOOT=TOPIC"
)]
struct LoadOfNoTopic(String);

impl Worded for LoadOfNoTopic {}

impl ListenArguments {
    /// Returns the sources and the feet.
    ///
    /// # Errors
    /// A source has no line, names of feet contradict each other, or options for reading a file are given for another
    /// source.
    pub(crate) fn sources_and_feet(self) -> Result<(Vec<Source>, KnownFeet), Error> {
        let (sources, feet) = self.feet.of_sources(&self.sources, &self.played)?;
        Ok((self.topics.apply(sources)?, feet))
    }
}

/// Feet with other ids or names than the default ones.
#[derive(Clone, Debug, Default, Args)]
pub struct FeetArguments {
    /// On CAN, a node to treat as a foot, in addition to ids 0x11 to 0x16; may be repeated
    #[arg(long = "node", value_name = "ID", value_parser = parse_node)]
    pub nodes: Vec<NodeId>,
    /// Names of feet: by node id, such as 1=FL,2=FR (these nodes count as feet), or on serial lines by the board's serial
    /// number or the port
    #[arg(long, value_name = "ID|SERIAL=NAME,...", value_delimiter = ',', value_parser = parse_name)]
    pub names: Vec<(NamedFoot, Name)>,
}

impl FeetArguments {
    /// Finds the sources, and returns them with their feet. Reports names of no line.
    ///
    /// # Errors
    /// A source has no line, names of feet contradict each other, or options for reading a file are given for another
    /// source.
    pub(crate) fn of_sources(
        mut self,
        sources: &[SourceArgument],
        played: &PlayedArguments,
    ) -> Result<(Vec<Source>, KnownFeet), Error> {
        // Names that contradict each other are an error even if one of them is of no line.
        self.feet()?;
        let sources = played.find_sources(sources)?;
        // The lines of files and of simulated feet are known only when they are read.
        if let Some(lines) = sources.iter().map(Source::device).collect::<Option<Vec<_>>>() {
            self.take_unused(&lines).into_iter().for_each(warn);
        }
        Ok((sources, self.feet()?))
    }

    /// Returns the feet.
    ///
    /// # Errors
    /// A foot is given two names, or two feet are given one name.
    pub(crate) fn feet(&self) -> Result<KnownFeet, NamedTwice> {
        let mut feet = KnownFeet::default();
        self.nodes.iter().for_each(|node| feet.add(*node));
        feet.give_names(&self.names)?;
        Ok(feet)
    }

    /// Removes the names of serial lines that are not among these lines, and returns a sentence about each. Otherwise
    /// such a name would be taken from the node that has it by default.
    pub(crate) fn take_unused(&mut self, lines: &[&str]) -> Vec<String> {
        let is_used = |foot: &NamedFoot| match foot {
            NamedFoot::Node(_) => true,
            NamedFoot::Line(named) => lines.iter().any(|line| names_line(named, line)),
        };
        let unused = self.names.extract_if(.., |(foot, _)| !is_used(foot));
        let sentence = |(foot, name): (NamedFoot, Name)| match foot {
            NamedFoot::Node(_) => None,
            NamedFoot::Line(named) => Some(format!(
                "--names {named}={name} names no line; the lines are {}",
                lines.join(", ")
            )),
        };
        unused.filter_map(sentence).collect()
    }
}

/// How a recording of an IMU is read and estimated when it is played as a source.
#[derive(Clone, Debug, Default, Args)]
pub struct PlayedArguments {
    /// Topics of a bag that are read.
    #[command(flatten)]
    pub bag: BagArguments,
    /// How tables are read.
    #[command(flatten)]
    pub table: TableArguments,
    /// How the sensor is mounted.
    #[command(flatten)]
    pub mounting: MountingArguments,
    /// Parameters to start from when a recording of an IMU is played
    #[arg(long, value_parser = preset_parser(), default_value = Preset::default().name(), help_heading = ESTIMATOR)]
    pub preset: Preset,
    /// TOML file with parameters that differ from the preset, for all feet or for single ones
    #[arg(long, value_name = "FILE.toml", help_heading = ESTIMATOR)]
    pub config: Option<PathBuf>,
    /// Estimate again from the samples of a bag. By default the contacts recorded with the samples are the
    /// estimates, and parameters have no effect
    #[arg(long, help_heading = ESTIMATOR)]
    pub estimate_again: bool,
}

impl PlayedArguments {
    /// Finds the sources, and returns them with these options.
    ///
    /// # Errors
    /// A source has no line, there are options for files but no source is a file, or the configuration file cannot be read
    /// or has an error.
    pub(crate) fn find_sources(&self, sources: &[SourceArgument]) -> Result<Vec<Source>, Error> {
        let playback = self.playback()?;
        let found = find_all(sources)?;
        if playback != Playback::default() && !found.iter().any(Source::is_estimated_here) {
            return Err(NotPlayed(text_of(sources)).into());
        }
        let found = found.into_iter();
        Ok(found.map(|source| source.played_with(playback.clone())).collect())
    }

    /// Returns how a file is read and estimated when it is played.
    ///
    /// # Errors
    /// The configuration file cannot be read or has an error.
    fn playback(&self) -> Result<Playback, Error> {
        let config = self.config.as_deref();
        let from_file = config.map(read_config).transpose()?.unwrap_or_default();
        let settings =
            Resolved { preset: self.preset, axes: self.mounting.axes.clone(), ..from_file };
        // The formats of the files are not known yet. The settings are checked again with the format of an opened file.
        settings.check_before_reading(Format::Csv)?;
        let contacts = ContactUse::unless_estimated(self.estimate_again);
        let input_options =
            settings.input_options(self.table.options(), self.bag.options(), contacts);
        let estimator_options = estimator_options(self.preset, config, None, &self.mounting);
        Ok(Playback { input_options, estimator_options, settings })
    }
}

/// Options about recordings of an IMU are given for feet that stream.
#[derive(Debug, thiserror::Error)]
#[error(
    "{0} is not a recording of an IMU: --config, --topic, --load-topic, --axes, --units and similar options apply only to file: and ros2:"
)]
struct NotPlayed(String);

impl Worded for NotPlayed {}

/// Returns the names of the given options that change an estimate and nothing else. A notice names them if the contacts
/// of a bag are the estimates, because they have no effect then.
pub(crate) fn estimator_options(
    preset: Preset,
    config: Option<&Path>,
    window: Option<WindowLength>,
    mounting: &MountingArguments,
) -> Vec<&'static str> {
    let options = [
        ("--preset", preset != Preset::default()),
        ("--config", config.is_some()),
        ("--window", window.is_some()),
        ("--axes", mounting.axes.is_some()),
    ];
    options.into_iter().filter(|(_, is_given)| *is_given).map(|(option, _)| option).collect()
}

/// Options of the command line that differ from their defaults. It has no option of its own: flatten it as the first
/// field, because clap takes the values of the other fields out of the matches.
#[derive(Clone, Debug, Default)]
pub struct GivenOptions {
    /// Values as given, by the id of their option.
    values: BTreeMap<String, Vec<OsString>>,
}

impl GivenOptions {
    /// Returns the names of the given options that are among the options `A`, in the order of their definition.
    pub(crate) fn among<A: Args>(&self) -> Vec<String> {
        let command = A::augment_args(clap::Command::new(""));
        let given = command.get_arguments().filter(|option| {
            let values = self.values.get(option.get_id().as_str());
            values.is_some_and(|values| *values != option.get_default_values())
        });
        given.filter_map(Arg::get_long).map(|name| format!("--{name}")).collect()
    }
}

impl FromArgMatches for GivenOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self::default();
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        let is_given =
            |id: &&Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
        for id in matches.ids().filter(is_given) {
            let values = matches.try_get_raw(id.as_str()).ok().flatten();
            let values = values.into_iter().flatten().map(OsStr::to_owned).collect();
            self.values.insert(id.to_string(), values);
        }
        Ok(())
    }
}

impl Args for GivenOptions {
    fn augment_args(command: clap::Command) -> clap::Command {
        command
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        command
    }
}

/// Whether results replace files of their names. Commands that write a file have this option.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct OverwriteArguments {
    /// Replace existing files
    #[arg(long, help_heading = OUTPUT)]
    pub overwrite: bool,
}

impl OverwriteArguments {
    pub(crate) const fn existing(self) -> Existing {
        if self.overwrite { Existing::Replaced } else { Existing::Kept }
    }
}

/// Frames of messages, and messages of other programs.
#[derive(Clone, Debug, Args)]
pub struct PublishedArguments {
    /// Also publish the decisions of all feet in messages of other programs, separated by commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',', value_parser = compat_parser())]
    pub compat: Vec<Compat>,
    /// Force of a foot that stands, N, in messages of --compat wrench
    #[arg(long, value_name = "NEWTONS", default_value_t = WRENCH_FORCE, value_parser = parse_force)]
    pub wrench_force: f64,
    /// Frame of the messages; {foot} is replaced by the foot's name
    #[arg(long, value_name = "FRAME", default_value = crate::ros::topics::FRAME)]
    pub frame_id: String,
    /// Prefix of the frames of all messages, such as spot/
    #[arg(long, value_name = "PREFIX", default_value = "", hide_default_value = true)]
    pub frame_prefix: String,
}

#[cfg(any(feature = "bags", feature = "foxglove", feature = "ros2"))]
impl PublishedArguments {
    /// Pattern of the frames.
    pub(crate) fn frame(&self) -> String {
        format!("{}{}", self.frame_prefix, self.frame_id)
    }

    /// Returns the conversion to messages.
    ///
    /// # Errors
    /// One of the forms is for a robot with two feet, and another for a robot with four.
    pub(crate) fn bridge(&self) -> Result<Bridge, Error> {
        let all_feet = AllFeet::unless_empty(&self.compat, self.wrench_force)?;
        Ok(Bridge::new(&self.frame(), all_feet))
    }
}

/// Parses a node id, decimal or hexadecimal with 0x.
pub(crate) fn parse_node(text: &str) -> Result<NodeId, &'static str> {
    let id = parse_number(text).and_then(|id| NodeId::new(u8::try_from(id).ok()?));
    id.ok_or("write a node id, 1 to 127 or 0x01 to 0x7F")
}

/// Parses a number, decimal or hexadecimal with 0x.
pub(crate) fn parse_number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Parses a node id, serial number or port with the name of its foot. A number of up to three digits is a node id:
/// otherwise an invalid id, such as 200, would be taken for a line that does not exist.
fn parse_name(text: &str) -> Result<(NamedFoot, Name), String> {
    let (foot, name) = text.split_once('=').ok_or("write a node id and a name, such as 1=FL")?;
    let name = Name::new(name).map_err(|error| error.to_string())?;
    let is_node = foot.len() <= 3 && foot.bytes().all(|byte| byte.is_ascii_digit());
    let named = match parse_node(foot) {
        Ok(node) => NamedFoot::Node(node),
        Err(error) if is_node || foot.is_empty() => return Err(error.to_owned()),
        Err(_) => {
            NamedFoot::Line(foot.trim_start_matches("usb:").trim_start_matches("uart:").to_owned())
        }
    };
    Ok((named, name))
}

/// Parser of a preset name; the help lists all presets.
pub(crate) fn preset_parser() -> impl TypedValueParser<Value = Preset> {
    name_parser(Preset::ALL, Preset::name, Preset::help)
}

/// Parser of a name of one of `all`; the help describes each.
pub(crate) fn name_parser<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
    help: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = all.map(|value| PossibleValue::new(name(value)).help(help(value)));
    PossibleValuesParser::new(names).try_map(move |text| {
        let found = all.into_iter().find(|value| name(*value) == text);
        found.ok_or("not in the list")
    })
}

/// Parser of one of several words; an error suggests the nearest word.
fn word_parser<T: Clone + Send + Sync + 'static, const N: usize>(
    words: [&'static str; N],
    parse: fn(&str) -> Result<T, String>,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words).try_map(move |word| parse(&word))
}

/// Parses a force, N.
pub(crate) fn parse_force(text: &str) -> Result<f64, &'static str> {
    let force = text.parse().ok().filter(|force: &f64| force.is_finite() && *force > 0.0);
    force.ok_or("write a force in N, more than 0")
}

/// Parser of a program's name; the help lists its message and topic.
pub(crate) fn compat_parser() -> impl TypedValueParser<Value = Compat> {
    name_parser(Compat::ALL, Compat::name, Compat::about)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the names that these sources use, and a sentence about each other name.
    fn names(given: &str, lines: &[&str]) -> (Vec<String>, Vec<String>) {
        let names = given.split(',').map(|text| parse_name(text).expect("a name")).collect();
        let mut feet = FeetArguments { nodes: Vec::new(), names };
        let unused = feet.take_unused(lines);
        (feet.names.into_iter().map(|(_, name)| name.to_string()).collect(), unused)
    }

    #[test]
    fn name_of_no_line_is_reported_and_not_used() {
        let given = "ttyACM9=FL,/dev/ttyACM1=FR,ttyACM0=RL,33=RR";
        let (left, unused) = names(given, &["/dev/ttyACM0", "/dev/ttyACM1"]);
        assert_eq!(left, ["FR", "RL", "RR"]);
        let expected = "--names ttyACM9=FL names no line; the lines are /dev/ttyACM0, /dev/ttyACM1";
        assert_eq!(unused, [expected]);
    }
}
