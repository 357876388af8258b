//! `footfall convert`: converts a recording to another format, and merges the recordings of a robot's feet.
//!
//! The output holds the inputs of the estimator: SI units in the frame of the foot, f32, times in µs on the
//! recording's clock, with load, validity and label. Estimates from the output are therefore bit-identical to those
//! from the source.

use std::io::{self, Write};
#[cfg(feature = "bags")]
use std::iter::Peekable;
use std::path::{Path, PathBuf};

use ::options::{ContactUse, Format};
use clap::{Args, ValueEnum};
use config::{Preset, Resolved, parse_seconds};
use estimator_core::Gravity;
#[cfg(feature = "bags")]
use estimator_core::Timestamp;
use estimator_core::params::LoadParams;
#[cfg(feature = "bags")]
use mcap::write::NoSeek;
use plausible::{Check, Finding};
use replay::Span;
use samples::RecordedSample;
use stored::Stored;
use stored::error::InputError;
use stored::rate::TimesSoFar;
use tables::output::{write_recording_header, write_recording_row};
#[cfg(feature = "parquet")]
use tables::parquet_output::ParquetSamples;

use super::options::{
    self, FootTwice, INPUT, OUTPUT, OverwriteArguments, ReadingArguments, with_mounting,
};
use super::span::{self, SpanError};
use crate::error::{Error, Worded};
use crate::feature::Feature;
use crate::files::{self, OutputError, STANDARD, Target, write_file};
use crate::messages::{aside, warn};
use crate::progress::Bars;
use crate::report::print_text;
use crate::ros::FootTopics;
use crate::ros::recording::{LAST_US, clock_shift_us};
use crate::ros::topics::unused_name;
#[cfg(feature = "bags")]
use crate::ros::{McapFile, SampleMessages, mcap_file::earliest};
use crate::words::in_words;

/// Examples of `footfall convert`.
pub const EXAMPLES: &str = "\
Examples:
  footfall convert walk.mcap walk.parquet --load-topic /ft:force.z
  footfall convert log.csv walk.mcap --units g,dps --axes x,-z,y
  footfall convert left.mcap right.mcap --output robot.mcap
  footfall convert walk.parquet - --from 10 --to 20 | head";

/// Arguments of `footfall convert`.
#[derive(Debug, Args)]
pub struct ConvertArguments {
    /// The recordings, in any format that `footfall replay` reads; `-` is standard input. Feet of several recordings
    /// become one .mcap. Without --output, the last name is the output
    #[arg(required = true, value_name = "RECORDING")]
    pub inputs: Vec<PathBuf>,
    /// The converted recording: its name ends in .csv, .parquet or .mcap; `-` is standard output
    #[arg(long, short, value_name = "OUT.csv|parquet|mcap", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Options for reading the recording.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Start at this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub from: Option<f64>,
    /// Stop at this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub to: Option<f64>,
    /// Format of the output, if its name does not show it
    #[arg(long = "as", value_name = "FORMAT", help_heading = OUTPUT)]
    pub form: Option<ConvertFormat>,
    /// Whether existing files are replaced.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
}

/// Properties of a foot found by scanning its samples.
#[derive(Default)]
struct Scan {
    samples: u64,
    has_load: bool,
    is_gravity_removed: bool,
    /// Sample rate, Hz, if its times do not show it.
    sample_rate: Option<f32>,
}

impl Scan {
    /// Returns the options required to read the output identically.
    fn options(&self) -> impl Iterator<Item = String> + use<> {
        let gravity = self.is_gravity_removed.then(|| "--gravity removed".to_owned());
        let rate = self.sample_rate.map(|rate| format!("--sample-rate {rate}"));
        gravity.into_iter().chain(rate)
    }
}

/// Reason recordings cannot be converted to the output.
#[derive(Debug, thiserror::Error)]
enum ConvertError {
    /// There is no output.
    #[error("no output is given: name it after the recordings, or with --output")]
    NoOutput,
    /// Several feet cannot be written to one table.
    #[error(
        "{file} has several feet, but a table holds one: {}; choose one with --topic, or write .mcap",
        feet.join(", ")
    )]
    OneFootOnly {
        /// Recordings as given.
        file: String,
        /// Names of the feet.
        feet: Vec<String>,
    },
}

impl Worded for ConvertError {}

impl ConvertArguments {
    pub(super) fn run(mut self) -> Result<(), Error> {
        let span = span::span(self.from, self.to)?;
        let output = match self.output.take() {
            Some(output) => output,
            None if self.inputs.len() > 1 => self.inputs.pop().unwrap_or_default(),
            None => return Err(ConvertError::NoOutput.into()),
        };
        let output_format = self.output_format(&output)?;
        files::check_inputs(&self.inputs)?;
        let resolved = self.reading.resolved(Preset::default(), None, None)?;
        let (formats, mut feet) = self.read(&resolved)?;
        let names = feet.iter().flat_map(|foot| foot.stored.about.names());
        resolved.check_axes(&names.collect::<Vec<_>>())?;
        if feet.len() > 1 && !output_format.holds_several() {
            let feet = feet.into_iter().map(|foot| foot.name).collect();
            return Err(ConvertError::OneFootOnly { file: self.input_names(), feet }.into());
        }
        let mut scans = Vec::new();
        for foot in &mut feet {
            let (scan, findings) =
                scan(foot, span).map_err(|source| InputError::spool(&foot.file, source))?;
            let place = options::place(&foot.file, foot.stored.about.foot.as_deref());
            self.reading.report(&place, &findings)?;
            scans.push(scan);
        }
        if scans.iter().all(|scan| scan.samples == 0) {
            return Err(SpanError::NoSample(self.input_names()).into());
        }
        let bag = self.write(&output, output_format, &mut feet, &scans, span)?;
        let has_loads = scans.iter().any(|scan| scan.has_load);
        let thresholds = formats.into_iter().find_map(thresholds).filter(|_| has_loads);
        print_summary(&output, &feet, &scans, bag.as_ref(), thresholds)
    }

    /// Reads all recordings, and returns their formats and feet. If two feet of one recording have the same name, the
    /// second gets a number.
    ///
    /// # Errors
    /// A recording cannot be read or ends before the span begins, or two recordings have a foot of the same name.
    fn read(&self, resolved: &Resolved) -> Result<(Vec<Format>, Vec<ConvertedFoot>), Error> {
        let mut formats = Vec::new();
        let mut feet: Vec<ConvertedFoot> = Vec::new();
        for input in &self.inputs {
            let file = input.display().to_string();
            let opened = files::open_recording(input, self.reading.format, &Bars::default())?;
            formats.push(opened.format());
            let input_options = self.reading.input_options(resolved, ContactUse::Ignored);
            let stored = opened.store_all(&input_options)?;
            span::check_begin(&file, self.from, &stored)?;
            for stored in stored {
                stored.about.notices.iter().map(in_words).for_each(warn);
                let name = stored.about.foot_or_name();
                let same = feet.iter().find(|foot| foot.name == name);
                if let Some(other) = same.filter(|other| other.file != file) {
                    let files = [other.file.clone(), file];
                    return Err(FootTwice { name: name.to_owned(), files }.into());
                }
                let taken = feet.iter().map(|foot| foot.name.as_str());
                let name = unused_name(name, &taken.collect::<Vec<_>>());
                feet.push(ConvertedFoot { name, file: file.clone(), stored });
            }
        }
        Ok((formats, feet))
    }

    /// Names of the recordings in messages.
    fn input_names(&self) -> String {
        let names = self.inputs.iter().map(|input| input.display().to_string());
        names.collect::<Vec<_>>().join(", ")
    }

    /// Returns the output format if it can be written.
    fn output_format(&self, output: &Path) -> Result<ConvertFormat, OutputError> {
        let named = || output.display().to_string();
        let format = self.form.or_else(|| ConvertFormat::of(output));
        let format = format.ok_or_else(|| OutputError::Extension {
            file: named(),
            kind: "recordings are CSV, Parquet or bags",
            expected: ConvertFormat::ENDINGS.to_owned(),
        })?;
        if let Some(feature) = format.feature() {
            feature.needed_for(named())?;
        }
        let target = Target::Samples(output);
        files::check(&self.inputs, &[target], self.overwrite.existing())?;
        Ok(format)
    }

    fn write(
        &self,
        path: &Path,
        format: ConvertFormat,
        feet: &mut [ConvertedFoot],
        scans: &[Scan],
        span: Span,
    ) -> Result<Option<Bag>, Error> {
        let existing = self.overwrite.existing();
        if !format.holds_several() {
            for foot in feet {
                write_file(path, existing, |to| write_table(format, &mut foot.stored, span, to))?;
            }
            return Ok(None);
        }
        let has_loads = scans.iter().any(|scan| scan.has_load);
        let bag = Bag::new(feet, has_loads)
            .ok_or_else(|| OutputError::TooLate(path.display().to_string()))?;
        #[cfg(feature = "bags")]
        write_file(path, existing, |to| bag.write(feet, span, to))?;
        if bag.shift_us != 0 {
            warn(format!(
                "{}: times of a bag begin after 1970-01-01 00:00:00, so all are {} s later than in {}",
                path.display(),
                bag.shift_us / 1_000_000,
                self.input_names()
            ));
        }
        Ok(Some(bag))
    }
}

/// Prints the output file, and the options with which it is read.
fn print_summary(
    output: &Path,
    feet: &[ConvertedFoot],
    scans: &[Scan],
    bag: Option<&Bag>,
    thresholds: Option<LoadParams>,
) -> Result<(), Error> {
    let counts = feet.iter().zip(scans);
    let counts = counts.map(|(foot, scan)| format!("{} samples of {}", scan.samples, foot.name));
    let counts: Vec<String> = counts.collect();
    let mut text = format!("wrote {}: {}\n", output.display(), counts.join(", "));
    text += &reading_text(bag, scans);
    if let Some(load) = thresholds {
        text += &format!(
            "and a configuration file with\n\
             load = {{ on_threshold = {:?}, off_threshold = {:?} }}\n",
            load.on_threshold, load.off_threshold
        );
    }
    if output == Path::new(STANDARD) {
        aside(text.trim_end());
        return Ok(());
    }
    print_text(&text).map_err(Error::Print)
}

/// Returns whether the feet need different sample rates as options. If so, no command can read all feet at once.
fn have_several_rates(scans: &[Scan]) -> bool {
    let mut rates = scans.iter().filter_map(|scan| scan.sample_rate);
    rates.next().is_some_and(|first| rates.any(|rate| rate != first))
}

/// Returns the lines with the options that read the output, if options are needed.
fn reading_text(bag: Option<&Bag>, scans: &[Scan]) -> String {
    match bag {
        Some(bag) if have_several_rates(scans) => reading_of_each(bag, scans),
        _ => reading_of_all(bag, scans),
    }
}

/// Returns the line with the options that read all feet of the output, if options are needed.
fn reading_of_all(bag: Option<&Bag>, scans: &[Scan]) -> String {
    let mut options: Vec<String> = Vec::new();
    if scans.len() > 1 {
        options.push("--topic all".to_owned());
    }
    if let Some(bag) = bag.filter(|bag| bag.has_loads) {
        // `--topic all` expects the load topics in the order of the feet's topic names.
        let mut topics: Vec<&FootTopics> = bag.topics.iter().collect();
        topics.sort_by(|a, b| a.imu.cmp(&b.imu));
        let topics = topics.into_iter();
        options.extend(topics.map(|topics| format!("--load-topic {}", topics.load)));
    }
    for option in scans.iter().flat_map(Scan::options) {
        if !options.contains(&option) {
            options.push(option);
        }
    }
    if options.is_empty() { String::new() } else { format!("read it with {}\n", options.join(" ")) }
}

/// Returns a line for each foot of a bag with the options that read it.
fn reading_of_each(bag: &Bag, scans: &[Scan]) -> String {
    let line = |(topics, scan): (&FootTopics, &Scan)| {
        let mut options = vec![format!("--topic {}", topics.imu)];
        options.extend(bag.has_loads.then(|| format!("--load-topic {}", topics.load)));
        options.extend(scan.options());
        format!("read one foot with {}\n", options.join(" "))
    };
    bag.topics.iter().zip(scans).map(line).collect()
}

/// Returns the default load thresholds of the input format if the output, which is read as CSV, has other defaults.
fn thresholds(format: Format) -> Option<LoadParams> {
    let of = |format| Preset::default().params(format).params.load;
    Some(of(format)).filter(|load| *load != of(Format::Csv))
}

/// Scans the samples to be converted for findings, and for the options with which the output is read.
fn scan(foot: &mut ConvertedFoot, span: Span) -> io::Result<(Scan, Vec<Finding>)> {
    let about = foot.stored.about.clone();
    let mut check = Check::new(about.sample_rate, about.gravity);
    let mut times = TimesSoFar::default();
    let mut found = Scan::default();
    for sample in samples(&mut foot.stored, span)? {
        let sample = sample?;
        check.add(&sample);
        let micros = i64::try_from(sample.imu.timestamp.as_micros());
        times.add(micros.unwrap_or(i64::MAX));
        found.samples += 1;
        found.has_load |= sample.load.is_some();
    }
    found.is_gravity_removed = about.gravity == Gravity::Removed;
    found.sample_rate = Some(about.sample_rate).filter(|rate| times.rate(None).ok() != Some(*rate));
    let mounting = &foot.stored.about.correction.mounting;
    Ok((found, with_mounting(check.findings(), mounting)))
}

/// Output formats of a conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ConvertFormat {
    /// A table: .csv
    Csv,
    /// The same columns, typed: .parquet
    Parquet,
    /// A bag of ROS 2: .mcap
    Mcap,
}

impl ConvertFormat {
    /// Accepted file extensions, for messages.
    pub const ENDINGS: &'static str = "csv, .parquet or .mcap";

    /// Returns the format for a file of this name; standard output gets a table.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        if path == Path::new(STANDARD) {
            return Some(Self::Csv);
        }
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let formats = [(".csv", Self::Csv), (".parquet", Self::Parquet), (".mcap", Self::Mcap)];
        let found = formats.into_iter().find(|(ending, _)| name.ends_with(ending));
        found.map(|(_, format)| format)
    }

    /// Returns the feature that writes the format; `None` if it needs none.
    #[must_use]
    pub const fn feature(self) -> Option<Feature> {
        match self {
            Self::Csv => None,
            Self::Parquet => Some(Feature::Parquet),
            Self::Mcap => Some(Feature::Bags),
        }
    }

    /// Returns whether the format holds several feet.
    #[must_use]
    pub const fn holds_several(self) -> bool {
        matches!(self, Self::Mcap)
    }
}

/// A foot to be converted.
pub struct ConvertedFoot {
    /// Name of the foot in the output.
    pub name: String,
    /// File of its recording, as given.
    pub file: String,
    /// Recording of the foot.
    pub stored: Stored,
}

/// Returns the samples of a foot within a span.
///
/// # Errors
/// The temporary file with the samples cannot be read.
pub fn samples(
    stored: &mut Stored,
    span: Span,
) -> io::Result<impl Iterator<Item = io::Result<RecordedSample>> + '_> {
    let is_in = move |sample: &io::Result<RecordedSample>| match sample {
        Ok(sample) => span.contains(sample.imu.timestamp),
        Err(_) => true,
    };
    Ok(stored.samples()?.filter(is_in))
}

/// Writes the table of a foot.
///
/// # Errors
/// Errors of the writer and of the temporary file.
pub fn write_table(
    format: ConvertFormat,
    stored: &mut Stored,
    span: Span,
    to: &mut dyn Write,
) -> io::Result<()> {
    let start_us = stored.about.start_us;
    match format {
        #[cfg(feature = "parquet")]
        ConvertFormat::Parquet => {
            let mut table = ParquetSamples::new(to)?;
            for sample in samples(stored, span)? {
                table.add(&sample?, start_us)?;
            }
            table.finish()?;
        }
        _ => {
            write_recording_header(to)?;
            for sample in samples(stored, span)? {
                write_recording_row(&sample?, start_us, to)?;
            }
        }
    }
    Ok(())
}

/// A bag as target of a conversion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bag {
    /// Topics of each foot.
    pub topics: Vec<FootTopics>,
    /// Whether the feet have loads: all or none.
    pub has_loads: bool,
    /// Offset of the bag's clock from the recording's, µs.
    pub shift_us: i64,
}

impl Bag {
    /// Creates a bag for these feet; `None` if a bag cannot hold their times.
    #[must_use]
    pub fn new(feet: &[ConvertedFoot], has_loads: bool) -> Option<Self> {
        let abouts = feet.iter().map(|foot| &foot.stored.about);
        let starts = abouts.clone().map(|about| about.start_us);
        let shift_us = clock_shift_us(starts.min().unwrap_or_default());
        let ends_us = abouts.map(|about| about.start_us.saturating_add_unsigned(about.duration_us));
        let ends_us = ends_us.max().unwrap_or_default();
        let is_in_time = ends_us.saturating_add(shift_us) <= LAST_US;
        is_in_time.then(|| Self {
            topics: feet.iter().map(|foot| FootTopics::of(&foot.name)).collect(),
            has_loads,
            shift_us,
        })
    }

    /// Writes the messages of all feet in order of time.
    ///
    /// # Errors
    /// Errors of the writer and of the temporary files.
    #[cfg(feature = "bags")]
    pub fn write(
        &self,
        feet: &mut [ConvertedFoot],
        span: Span,
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let mut bag = McapFile::new(NoSeek::new(to))?;
        let mut streams = Vec::new();
        for foot in feet {
            let offset_us = foot.stored.about.start_us + self.shift_us;
            let messages = SampleMessages::new(&foot.name);
            streams.push(SampleStream {
                offset_us,
                messages: if self.has_loads { messages.with_load() } else { messages },
                samples: samples(&mut foot.stored, span)?.peekable(),
            });
        }
        while let Some((at, index)) = earliest(&mut streams, |stream| {
            let next = stream.next_at()?;
            Ok(next.map(|at| (at, at)))
        })? {
            let stream = &mut streams[index];
            if let Some(sample) = stream.samples.next() {
                let mut messages = stream.messages.messages(&sample?, at).into_iter();
                messages.try_for_each(|published| bag.write(&published))?;
            }
        }
        bag.finish()
    }
}

/// Samples of a foot to be written to a bag.
#[cfg(feature = "bags")]
struct SampleStream<I: Iterator<Item = io::Result<RecordedSample>>> {
    /// Offset added to the timestamps, µs.
    offset_us: i64,
    messages: SampleMessages,
    samples: Peekable<I>,
}

#[cfg(feature = "bags")]
impl<I: Iterator<Item = io::Result<RecordedSample>>> SampleStream<I> {
    /// Returns the acquisition time of the next sample, on the clock of the bag.
    fn next_at(&mut self) -> io::Result<Option<Timestamp>> {
        if let Some(Err(error)) = self.samples.next_if(Result::is_err) {
            return Err(error);
        }
        let next = self.samples.peek().and_then(|next| next.as_ref().ok());
        Ok(next.map(|sample| {
            let micros = sample.imu.timestamp.as_micros();
            Timestamp::from_micros(micros.saturating_add_signed(self.offset_us))
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(rate: Option<f32>) -> Scan {
        Scan { sample_rate: rate, is_gravity_removed: true, ..Scan::default() }
    }

    #[test]
    fn feet_with_different_rates_are_read_by_a_command_each() {
        let bag =
            Bag { topics: ["FL", "FR"].map(FootTopics::of).into(), has_loads: true, shift_us: 0 };
        let same = [scan(Some(100.0)), scan(Some(100.0))];
        assert_eq!(
            reading_text(Some(&bag), &same),
            "read it with --topic all --load-topic /footfall/FL/load --load-topic /footfall/FR/load --gravity removed --sample-rate 100\n"
        );
        let different = [scan(Some(100.0)), scan(Some(200.0))];
        assert_eq!(
            reading_text(Some(&bag), &different),
            "read one foot with --topic /footfall/FL/imu --load-topic /footfall/FL/load --gravity removed --sample-rate 100\n\
             read one foot with --topic /footfall/FR/imu --load-topic /footfall/FR/load --gravity removed --sample-rate 200\n"
        );
        assert_eq!(reading_text(None, &[Scan::default()]), "");
    }
}
