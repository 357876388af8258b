//! `footfall calibrate`.

mod live;
mod topics;

use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::io;
use std::path::{Path, PathBuf};

use ::options::{ContactUse, Correction, Format, InputOptions};
use calibration::CalibrationError;
use calibration::learnt::{LearntCalibration, LearntFoot};
use calibration::robot_file::RobotFile;
use calibration::sensor::SensorCalibration;
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use config::{ConfigError, Resolved};
use estimator_core::any::AnyParams;
use plausible::{self, Finding};
use recordings::Opened;
use replay::ReplayError;
use replay::summary::{InputReport, LoadThresholds, WithInputs};
use samples::mounting::{MountingReport, RestingUp};
use serde::Serialize;
use stored::Loaded;
use stored::error::InputError;
use wire::NodeId;

use super::options::{
    self, ESTIMATOR, GivenOptions, INPUT, OUTPUT, OverwriteArguments, RecordingArguments,
    TopicArguments, check, parse_node,
};
use crate::Source;
use crate::error::{Error, Worded};
use crate::files::{self, OutputError, STANDARD, Target, write_file};
use crate::messages::{aside, detail, warn};
use crate::progress::Bars;
use crate::report::{Described, SummaryStyle, print};
use crate::words::{CommandLine, in_words};

/// Examples of `footfall calibrate`.
pub const EXAMPLES: &str = "\
Examples:
  footfall calibrate walk.csv --output robot.toml
  footfall calibrate usb --write
  footfall calibrate --rests sides.csv --config robot.toml --output robot.toml --overwrite
  footfall replay walk.csv --config robot.toml";

/// Arguments of `footfall calibrate`.
#[derive(Debug, Args)]
pub struct CalibrateArguments {
    /// The options that are given.
    #[command(flatten)]
    pub given: GivenOptions,
    /// Recordings of one walking foot; or, with --rests, of one sensor lying still on each of its six sides.
    /// Labels and load are not used. Several feet of a bag (--topic all) are calibrated separately, each with
    /// a table [feet.NAME] in the output. Or feet as they walk: usb, usb:FR, uart:PORT, can:INTERFACE, ros2:TOPIC
    /// or demo
    #[arg(required = true, value_name = "FILE|SOURCE")]
    pub inputs: Vec<PathBuf>,
    /// Results of files.
    #[command(flatten)]
    pub files: FileArguments,
    /// Options for reading the recordings, and the parameters of the estimates.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Write a file for --config: the settings of the given --config, updated with the result
    #[arg(long, short, value_name = "OUT.toml", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Whether an existing file is replaced, such as the file of --config.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
    /// Loads on topics, and their domain.
    #[command(flatten)]
    pub topics: TopicArguments,
    /// How walking feet are calibrated.
    #[command(flatten)]
    pub walking: WalkingArguments,
    /// Print the report as one JSON object
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,
}

/// Result of files, and the foot that has it.
#[derive(Debug, Args)]
pub struct FileArguments {
    /// Find the bias and scale of the accelerometer and the bias of the gyroscope instead
    #[arg(long, conflicts_with = "axes", help_heading = ESTIMATOR)]
    pub rests: bool,
    /// Write the result as settings of this foot: the table [feet.NAME]
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new(), requires = "output", help_heading = OUTPUT)]
    pub foot: Option<String>,
}

/// How walking feet are calibrated.
#[derive(Debug, Args)]
pub struct WalkingArguments {
    /// Write the learnt values and the axes of walking feet to the feet without asking
    #[arg(long, help_heading = OUTPUT)]
    pub write: bool,
    /// Longest wait for each step of a walking foot, s
    #[arg(long, value_name = "S", default_value_t = 120, value_parser = clap::value_parser!(u16).range(1..=3600), help_heading = INPUT)]
    pub seconds: u16,
    /// Node id of a walking foot on a CAN bus, 1 to 127; not needed if there is only one foot
    #[arg(long, value_name = "ID", value_parser = parse_node, help_heading = INPUT)]
    pub node: Option<NodeId>,
}

/// Recording of a foot, with its file.
struct Input {
    file: String,
    format: Format,
    loaded: Loaded,
}

impl CalibrateArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(sources) = live::sources(&self.inputs)? {
            let is_topic = |source: &Source| matches!(source, Source::Topics(_));
            if sources.iter().all(is_topic) {
                let mut of_feet = self.given.among::<WalkingArguments>();
                of_feet.retain(|option| option != "--seconds");
                check_unused("topics", &[self.given.among::<FileArguments>(), of_feet])?;
                return topics::calibrate(self, sources);
            }
            if let Some(topics) = sources.iter().find(|source| is_topic(source)) {
                return Err(CalibrateError::TopicsAndFeet(topics.to_string()).into());
            }
            let sources = self.topics.apply(sources)?;
            // --config is allowed, because the result updates its file.
            let mut of_recordings = self.given.among::<RecordingArguments>();
            of_recordings.retain(|option| option != "--config");
            let of_files = [self.given.among::<FileArguments>(), of_recordings];
            check_unused("walking feet", &of_files)?;
            return live::calibrate(self, &sources);
        }
        let of_topics = self.given.among::<TopicArguments>();
        check_unused("recordings", &[of_topics, self.given.among::<WalkingArguments>()])?;
        files::check_inputs(&self.inputs)?;
        self.check_output(&self.inputs)?;
        let resolved = self.recording.resolved(None)?;
        if self.files.rests { self.calibrate_sensor(&resolved) } else { self.learn(&resolved) }?;
        if self.output.is_none() && !self.json {
            aside(
                "not kept: --output robot.toml writes it to a file, for footfall replay with --config robot.toml",
            );
        }
        Ok(())
    }

    /// Checks that the configuration file can be written.
    fn check_output(&self, inputs: &[PathBuf]) -> Result<(), Error> {
        let configuration = self.output.as_deref().map(Target::Configuration);
        files::check(inputs, configuration.as_slice(), self.overwrite.existing())?;
        if self.json && self.fills_stdout() {
            return Err(OutputError::StdoutTwice.into());
        }
        Ok(())
    }

    /// Returns whether the configuration file goes to standard output.
    fn fills_stdout(&self) -> bool {
        self.output.as_deref() == Some(Path::new(STANDARD))
    }

    /// Returns the properties of the files, with the correction of the foot that is calibrated.
    fn input_options(&self, resolved: &Resolved) -> Result<InputOptions, Error> {
        let mut input_options = self.recording.reading.input_options(resolved, ContactUse::Ignored);
        match (&self.files.foot, input_options.foot_corrections.keys().next()) {
            (Some(foot), _) => {
                let foot = foot.as_str();
                resolved.check_axes(&[foot])?;
                input_options.correction = *input_options.correction_of(&[foot]);
                input_options.foot_corrections.clear();
            }
            (None, Some(named)) => return Err(CalibrateError::WhichFoot(named.clone()).into()),
            (None, None) => {}
        }
        Ok(input_options)
    }

    /// Opens a recording, with a progress bar.
    fn open(&self, input: &Path) -> Result<Opened, InputError> {
        files::open_recording(input, self.recording.reading.format, &Bars::default())
    }

    /// Reads the recordings, each of one foot.
    fn recordings(
        &self,
        input_options: &InputOptions,
    ) -> impl Iterator<Item = Result<Input, Error>> {
        self.inputs.iter().map(|input| {
            let opened = self.open(input)?;
            Ok(Input {
                file: input.display().to_string(),
                format: opened.format(),
                loaded: opened.read(input_options)?,
            })
        })
    }

    /// Reports the findings of a recording of `foot`, and returns its report.
    fn report(
        &self,
        input: &Input,
        foot: Option<&str>,
        findings: &[Finding],
    ) -> Result<InputReport, Error> {
        let (file, format) = (input.file.as_str(), input.format);
        let place = options::place(file, foot);
        self.recording.reading.report(&place, findings)?;
        let (notices, repairs) = (&input.loaded.notices, input.loaded.repairs);
        Ok(InputReport::new(file, format, notices, repairs, findings, &CommandLine))
    }

    /// Learns a foot, or each foot of a bag with several.
    fn learn(&self, resolved: &Resolved) -> Result<(), Error> {
        if self.files.foot.is_none() && self.recording.reading.bag.may_be_of_several_feet() {
            return self.learn_feet(resolved);
        }
        let input_options = self.input_options(resolved)?;
        let inputs = self.recordings(&input_options);
        let report =
            self.learn_foot(resolved, self.files.foot.as_deref(), &input_options, inputs)?;
        self.write_outputs(resolved, &report, |file| {
            set_learnt(file.of_foot(self.files.foot.clone()), &report)
        })
    }

    /// Calibrates each foot of the recordings.
    fn learn_feet(&self, resolved: &Resolved) -> Result<(), Error> {
        let input_options = self.recording.reading.input_options(resolved, ContactUse::Ignored);
        let mut inputs: BTreeMap<String, Vec<Input>> = BTreeMap::new();
        for input in &self.inputs {
            let opened = self.open(input)?;
            let (file, format) = (input.display().to_string(), opened.format());
            for stored in opened.store_all(&input_options)? {
                let foot = stored.about.foot_or_name().to_owned();
                let loaded = stored.into_loaded();
                let loaded = loaded.map_err(ReplayError::from)?;
                inputs.entry(foot).or_default().push(Input { file: file.clone(), format, loaded });
            }
        }
        self.learn_each(resolved, &input_options, inputs)
    }

    /// Calibrates each foot by its recordings.
    fn learn_each(
        &self,
        resolved: &Resolved,
        input_options: &InputOptions,
        inputs: BTreeMap<String, Vec<Input>>,
    ) -> Result<(), Error> {
        let names: Vec<&str> = inputs.keys().map(String::as_str).collect();
        resolved.check_axes(&names)?;
        resolved.unused_feet(&names).into_iter().for_each(warn);
        let mut feet = BTreeMap::new();
        for (foot, inputs) in inputs {
            let input_options = InputOptions {
                correction: *input_options.correction_of(&[&foot]),
                foot_corrections: BTreeMap::new(),
                ..input_options.clone()
            };
            let inputs = inputs.into_iter().map(Ok);
            let report = self.learn_foot(resolved, Some(&foot), &input_options, inputs);
            let report = report.map_err(|source| CalibrateError::OfFoot {
                foot: foot.clone(),
                source: Box::new(source),
            })?;
            feet.insert(foot, report);
        }
        let report = FeetReport { feet };
        self.write_outputs(resolved, &report, |file| {
            report.feet.iter().fold(file, |file, (foot, report)| {
                set_learnt(file.of_foot(Some(foot.clone())), report)
            })
        })
    }

    /// Learns from the recordings of a foot.
    fn learn_foot(
        &self,
        resolved: &Resolved,
        foot: Option<&str>,
        input_options: &InputOptions,
        recordings: impl Iterator<Item = Result<Input, Error>>,
    ) -> Result<WithInputs<LearntFoot>, Error> {
        let mut inputs = BTreeMap::new();
        let mut rest = RestingUp::default();
        let mut calibration = None;
        let mut load = None;
        for input in recordings {
            let input = input?;
            let (file, loaded, format) = (&input.file, &input.loaded, input.format);
            let params = resolved.params_of(foot.as_slice(), format);
            let origins = resolved.origins(file);
            origins.check_effects(&params)?;
            let calibration = match &mut calibration {
                Some(calibration) => calibration,
                none => none.insert(LearntCalibration::new(&params)?),
            };
            loaded.notices.iter().map(in_words).for_each(warn);
            detail(format!(
                "{file}: format {}, {} samples at {} Hz; {}",
                format.name(),
                loaded.recording.samples.len(),
                loaded.recording.sample_rate,
                self.recording.parameters_text(&params, format)
            ));
            let findings = check(
                &loaded.recording,
                &loaded.recording.name,
                input_options,
                Some(params.params.load),
            );
            load = load.or_else(|| findings.iter().find_map(crossed_thresholds));
            inputs.insert(file.clone(), self.report(&input, foot, &findings)?);
            rest.add(plausible::gravity_at_rest(&loaded.recording));
            let bar = Bars::default().estimating(loaded.recording.samples.len() as u64);
            let learnt = calibration.add(&loaded.recording, || bar.inc(1));
            bar.finish_and_clear();
            learnt.map_err(|error| origins.explain(&error))?;
        }
        // Without a recording, the empty calibration reports that nothing was learnt.
        let calibration =
            calibration.map_or_else(|| LearntCalibration::new(&AnyParams::DEFAULT), Ok)?;
        let learnt = calibration.finish()?;
        if let Some(degrees) = rest.disagreement() {
            warn(format!(
                "the direction of up differs by {degrees:.0}° from the mean of all recordings, so no axes are found: calibrate recordings of one mounting together"
            ));
        }
        Ok(WithInputs {
            report: learnt,
            mounting: MountingReport::of(&rest, &input_options.correction.mounting),
            load,
            inputs,
        })
    }

    /// Finds the errors of the sensor from rests on each of its sides.
    fn calibrate_sensor(&self, resolved: &Resolved) -> Result<(), Error> {
        let mut input_options = self.input_options(resolved)?;
        // Previous results are replaced, not added to.
        input_options.correction = Correction::NONE;
        let recordings = self.recordings(&input_options).collect::<Result<Vec<_>, _>>()?;
        let notices = recordings.iter().flat_map(|input| &input.loaded.notices);
        notices.map(in_words).for_each(warn);
        let mut inputs = BTreeMap::new();
        for input in &recordings {
            let recording = &input.loaded.recording;
            let mut findings = check(recording, &recording.name, &input_options, None);
            // In this calibration the sensor lies on each of its sides in turn.
            findings.retain(|finding| !matches!(finding, Finding::GravityNotAlongZ { .. }));
            let report = self.report(input, self.files.foot.as_deref(), &findings)?;
            inputs.insert(input.file.clone(), report);
        }
        let recordings = recordings.iter().map(|input| &input.loaded.recording);
        let sensor = SensorCalibration::of(recordings).map_err(CalibrationError::from)?;
        let report = WithInputs { report: sensor, mounting: None, load: None, inputs };
        self.write_outputs(resolved, &report, |file| {
            let mut file = file.of_foot(self.files.foot.clone());
            file.set_sensor(&report.report);
            file
        })
    }

    /// Writes the configuration file, if any, and prints the report.
    fn write_outputs(
        &self,
        resolved: &Resolved,
        report: &(impl Described + Display),
        set: impl FnOnce(RobotFile) -> RobotFile,
    ) -> Result<(), Error> {
        if let Some(path) = &self.output {
            let file = RobotFile::keeping(resolved.file_text());
            let file = file.map_err(|error| ConfigError::Unreadable {
                file: resolved.file_name().to_owned(),
                source: io::Error::other(error),
            })?;
            let text = set(file).text();
            let existing = self.overwrite.existing();
            write_file(path, existing, |to| to.write_all(text.as_bytes()))?;
        }
        if self.fills_stdout() {
            aside(report);
            return Ok(());
        }
        print(report, SummaryStyle::of(self.json), &self.output).map_err(Error::Print)
    }
}

/// Reason nothing was calibrated, beside the contents of the recordings.
#[derive(Debug, thiserror::Error)]
enum CalibrateError {
    /// Files and walking feet are to be calibrated at once.
    #[error("files and walking feet are calibrated separately: name one kind")]
    FilesAndFeet,
    /// Topics and feet are to be calibrated together.
    #[error(
        "{0} and feet with a program of their own are calibrated one after the other: the former is estimated here"
    )]
    TopicsAndFeet(String),
    /// Options are given that only the other kind of input uses.
    #[error("the calibration of {inputs} does not use {options}")]
    UnusedOptions {
        /// Kind of the inputs.
        inputs: &'static str,
        options: String,
    },
    /// The configuration has settings of single feet, and the foot to calibrate is not named.
    #[error(
        "the configuration has settings only of the foot {0}: name the foot to calibrate with --foot"
    )]
    WhichFoot(String),
    /// One of several feet cannot be calibrated.
    #[error("foot {foot}: {source}")]
    OfFoot { foot: String, source: Box<Error> },
}

impl Worded for CalibrateError {}

/// Checks that no option is given that has no effect on inputs of this kind.
fn check_unused(inputs: &'static str, given: &[Vec<String>]) -> Result<(), CalibrateError> {
    let given = given.concat();
    if given.is_empty() {
        return Ok(());
    }
    Err(CalibrateError::UnusedOptions { inputs, options: given.join(", ") })
}

/// Report on the calibration of several feet.
#[derive(Debug, Serialize)]
pub struct FeetReport {
    /// Reports by the name of the foot.
    feet: BTreeMap<String, WithInputs<LearntFoot>>,
}

impl Described for FeetReport {
    const SCHEMA: &'static str = "urn:footfall:calibrate-feet:1";
}

impl Display for FeetReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (foot, report)) in self.feet.iter().enumerate() {
            let gap = if k > 0 { "\n\n" } else { "" };
            write!(f, "{gap}foot {foot}\n{report}")?;
        }
        Ok(())
    }
}

/// Sets the learnt values, the mounting and the load thresholds in `file`, for its current foot.
fn set_learnt(mut file: RobotFile, report: &WithInputs<LearntFoot>) -> RobotFile {
    file.set_learnt(&report.report);
    file.set_mounting(report.mounting.as_ref());
    if let Some(load) = &report.load {
        file.set_load(load);
    }
    file
}

/// Thresholds that the load crosses; `None` if it crosses the thresholds in use.
fn crossed_thresholds(finding: &Finding) -> Option<LoadThresholds> {
    match finding {
        Finding::LoadNeverCrosses { on, off, .. } => {
            Some(LoadThresholds { on_threshold: *on, off_threshold: *off })
        }
        _ => None,
    }
}
