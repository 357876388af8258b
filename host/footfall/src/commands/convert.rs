//! `footfall convert`: converts a recording to another format.

use std::io;
use std::path::{Path, PathBuf};

use crate::ros::FootTopics;
use clap::Args;
use estimator_core::Gravity;
use estimator_core::params::LoadParams;
use recordings::analysis::replay::span::Span;
use recordings::config::{Preset, parse_seconds};
use recordings::input::{Format, InputError, TimesSoFar};
use recordings::plausible::{Check, Finding};

use super::headings::{INPUT, OUTPUT};
use super::options::recording::{self, ReadingArguments, with_mounting};
use crate::convert::{Bag, ConvertFormat, ConvertedFoot, samples, write_table};
use crate::error::Error;
use crate::files::{OutputError, STANDARD, write_file};
use crate::foot_names::unlike;
use crate::messages::{aside, warn};
use crate::progress::{self, Bars};
use crate::report::print_text;
use crate::targets::{self, Target};

/// Arguments of `footfall convert`.
#[derive(Debug, Args)]
pub struct ConvertArguments {
    /// The recording, in any format that `footfall replay` reads; `-` is standard input
    pub input: PathBuf,
    /// The converted recording: its name ends in .csv, .parquet or .mcap; `-` is standard output
    pub output: PathBuf,
    /// How it is read.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Leave out what comes before this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub from: Option<f64>,
    /// Stop at this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub to: Option<f64>,
    /// Format of the output, where its name does not say it
    #[arg(long = "as", value_name = "FORMAT", help_heading = OUTPUT)]
    pub form: Option<ConvertFormat>,
    /// Replace a file of this name
    #[arg(long, help_heading = OUTPUT)]
    pub overwrite: bool,
}

/// Properties of a foot found by scanning its samples.
#[derive(Default)]
struct Looked {
    samples: u64,
    has_load: bool,
    /// Options required to read the output identically.
    options: Vec<String>,
}

impl ConvertArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let span = recording::span(self.from, self.to)?;
        let form = self.form()?;
        let file = self.input.display().to_string();
        let opened = progress::open(&self.input, self.reading.format, &Bars::default())?;
        let format = opened.format();
        let resolved = self.reading.resolved(Preset::default(), None)?;
        let hints = self.reading.hints(&resolved);
        let stored = opened.store_all(&hints)?;
        recording::check_begin(&file, self.from, &stored)?;
        let names = stored.iter().flat_map(|stored| stored.about.names());
        resolved.check_axes(&names.collect::<Vec<_>>())?;
        let mut feet: Vec<ConvertedFoot> = Vec::new();
        for stored in stored {
            stored.about.notices.iter().for_each(warn);
            let taken = feet.iter().map(|foot| foot.name.as_str());
            let name = unlike(stored.about.foot_or_name(), &taken.collect::<Vec<_>>());
            feet.push(ConvertedFoot { name, stored });
        }
        if feet.len() > 1 && !form.holds_several() {
            let feet = feet.into_iter().map(|foot| foot.name).collect();
            return Err(Error::OneFootOnly { file, feet });
        }
        let mut looked = Vec::new();
        for foot in &mut feet {
            let (looked_at, findings) = look(foot, span)
                .map_err(|source| InputError::Spool { file: file.clone(), source })?;
            let place = recording::place(&file, foot.stored.about.foot.as_deref());
            self.reading.report(&place, &findings)?;
            looked.push(looked_at);
        }
        if looked.iter().all(|looked| looked.samples == 0) {
            return Err(Error::NothingInSpan(file));
        }
        let bag = self.write(form, &mut feet, &looked, span)?;
        let has_loads = looked.iter().any(|looked| looked.has_load);
        let thresholds = thresholds(format).filter(|_| has_loads);
        self.say(&feet, &looked, bag.as_ref(), thresholds)
    }

    /// Returns the output format if it can be written.
    fn form(&self) -> Result<ConvertFormat, OutputError> {
        let output = self.output.as_path();
        let named = || output.display().to_string();
        let form = self.form.or_else(|| ConvertFormat::of(output));
        let form = form.ok_or_else(|| OutputError::Extension {
            file: named(),
            kind: "recordings are CSV, Parquet or bags",
            expected: ConvertFormat::ENDINGS.to_owned(),
        })?;
        if let Some(feature) = form.feature() {
            feature.needed_for(named())?;
        }
        let target = Target::Samples(output);
        targets::check(std::slice::from_ref(&self.input), &[target])?;
        match output.is_file() && !self.overwrite {
            true => Err(OutputError::Exists(named())),
            false => Ok(form),
        }
    }

    fn write(
        &self,
        form: ConvertFormat,
        feet: &mut [ConvertedFoot],
        looked: &[Looked],
        span: Span,
    ) -> Result<Option<Bag>, Error> {
        let path = self.output.as_path();
        if !form.holds_several() {
            for foot in feet {
                write_file(path, |to| write_table(form, &mut foot.stored, span, to))?;
            }
            return Ok(None);
        }
        let has_loads = looked.iter().any(|looked| looked.has_load);
        let bag = Bag::new(feet, has_loads)
            .ok_or_else(|| OutputError::TooLate(path.display().to_string()))?;
        #[cfg(feature = "bags")]
        write_file(path, |to| bag.write(feet, span, to))?;
        if bag.shift_us != 0 {
            warn(format!(
                "{}: times of a bag begin after 1970-01-01 00:00:00, so all are {} s later than in {}",
                path.display(),
                bag.shift_us / 1_000_000,
                self.input.display()
            ));
        }
        Ok(Some(bag))
    }

    /// Prints the output files and the options to read them.
    fn say(
        &self,
        feet: &[ConvertedFoot],
        looked: &[Looked],
        bag: Option<&Bag>,
        thresholds: Option<LoadParams>,
    ) -> Result<(), Error> {
        let output = self.output.display();
        let counts = feet.iter().zip(looked);
        let counts = counts.map(|(foot, of)| format!("{} samples of {}", of.samples, foot.name));
        let counts: Vec<String> = counts.collect();
        let mut options: Vec<String> = Vec::new();
        if feet.len() > 1 {
            options.push("--topic all".to_owned());
        }
        if let Some(bag) = bag.filter(|bag| bag.has_loads) {
            // `--topic all` expects the load topics in the order of the feet's topic names.
            let mut topics: Vec<&FootTopics> = bag.topics.iter().collect();
            topics.sort_by(|a, b| a.imu.cmp(&b.imu));
            let topics = topics.into_iter();
            options.extend(topics.map(|topics| format!("--load-topic {}", topics.load)));
        }
        for option in looked.iter().flat_map(|looked| &looked.options) {
            if !options.contains(option) {
                options.push(option.clone());
            }
        }
        let mut text = format!("wrote {output}: {}\n", counts.join(", "));
        if !options.is_empty() {
            text += &format!("read it with {}\n", options.join(" "));
        }
        if let Some(load) = thresholds {
            text += &format!(
                "and a configuration file with\n\
                 load = {{ on_threshold = {:?}, off_threshold = {:?} }}\n",
                load.on_threshold, load.off_threshold
            );
        }
        if self.output == Path::new(STANDARD) {
            aside(text.trim_end());
            return Ok(());
        }
        print_text(&text).map_err(Error::Print)
    }
}

/// Returns the default load thresholds of a format if they differ from those of the output.
fn thresholds(format: Format) -> Option<LoadParams> {
    let of = |format| Preset::default().params(format).load;
    Some(of(format)).filter(|load| *load != of(Format::Csv))
}

/// Scans the samples to be converted for findings and for the options the output needs.
fn look(foot: &mut ConvertedFoot, span: Span) -> io::Result<(Looked, Vec<Finding>)> {
    let about = foot.stored.about.clone();
    let mut check = Check::new(about.sample_rate, about.gravity);
    let mut times = TimesSoFar::default();
    let mut looked = Looked::default();
    for sample in samples(&mut foot.stored, span)? {
        let sample = sample?;
        check.add(&sample);
        let micros = i64::try_from(sample.imu.timestamp.as_micros());
        times.add(micros.unwrap_or(i64::MAX));
        looked.samples += 1;
        looked.has_load |= sample.load.is_some();
    }
    if about.gravity == Gravity::Removed {
        looked.options.push("--gravity removed".to_owned());
    }
    if times.rate(None).ok() != Some(about.sample_rate) {
        let rate = about.sample_rate;
        looked.options.push(format!("--sample-rate {rate}"));
    }
    let mounting = &foot.stored.about.correction.mounting;
    Ok((looked, with_mounting(check.findings(), mounting)))
}
