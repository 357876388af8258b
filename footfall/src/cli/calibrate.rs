//! `footfall calibrate`.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

use clap::Args;
use estimator_core::Gravity;
use serde::Serialize;

use super::{Configuration, tell};
use crate::calibrate::CalibrationError;
use crate::calibrate::half_width::HalfWidthCalibration;
use crate::calibrate::robot_file::RobotFile;
use crate::calibrate::sensor::SensorCalibration;
use crate::config::{ConfigError, Preset, parse_gravity, parse_sample_rate};
use crate::error::Error;
use crate::input::{Correction, Format, Loaded, Opened};
use crate::output::write_file;
use crate::plot;
use crate::report::{SummaryStyle, print};
use crate::targets;

/// What `footfall calibrate` takes.
#[derive(Debug, Args)]
pub struct CalibrateArguments {
    /// Recordings of one foot that walks on good ground; or with --rests of one sensor that lies
    /// still on each of its six sides. No labels are used; the load is, where it was recorded
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// Find accelerometer bias and scale and gyroscope bias instead of half-widths
    #[arg(long, conflicts_with = "plot")]
    pub rests: bool,
    /// How the files are laid out; may be left out where a header names the columns (csv)
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Where the parameters start from
    #[arg(long, value_enum, default_value_t)]
    pub preset: Preset,
    /// A TOML file with parameters that differ from the preset; what is calibrated replaces them
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Sample rate, where the files do not tell or their nominal rate is wrong
    #[arg(long, value_name = "HZ", value_parser = parse_sample_rate)]
    pub sample_rate: Option<f32>,
    /// Whether the accelerations contain gravity: included or removed
    #[arg(long, value_name = "included|removed", value_parser = parse_gravity)]
    pub gravity: Option<Gravity>,
    /// Write a file for --config: what --config set before, and what was found
    #[arg(long, value_name = "OUT.toml")]
    pub output: Option<PathBuf>,
    /// Write each axis' distribution with ± its half-width, which is an SVG
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl CalibrateArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        for input in &self.inputs {
            targets::check(input, self.output.as_deref(), self.plot.as_deref())?;
        }
        let configuration = Configuration::read(self.config.as_deref())?;
        if self.rests {
            self.calibrate_sensor(&configuration)
        } else {
            self.calibrate_half_widths(&configuration)
        }
    }

    fn calibrate_half_widths(&self, configuration: &Configuration) -> Result<(), Error> {
        let hints = configuration.hints(self.sample_rate, self.gravity)?;
        let mut calibration = None;
        for input in &self.inputs {
            let opened = Opened::new(input, self.format)?;
            let mut params = self.preset.params(opened.format());
            configuration.overrides.apply(&mut params);
            let loaded = opened.read(&hints)?;
            tell(&loaded.notices);
            calibration
                .get_or_insert_with(|| HalfWidthCalibration::new(&params))
                .add(&loaded.recording)?;
        }
        let Some(calibration) = calibration else {
            return Ok(());
        };
        let half_widths = calibration.finish()?;
        if let Some(path) = &self.plot {
            write_file(path, |to| {
                to.write_all(plot::distribution::svg(&half_widths)?.as_bytes())
            })?;
        }
        self.hand_over(configuration, &half_widths, |file| {
            file.set_half_widths(&half_widths);
        })
    }

    fn calibrate_sensor(&self, configuration: &Configuration) -> Result<(), Error> {
        let mut hints = configuration.hints(self.sample_rate, self.gravity)?;
        // What was found before is replaced, not added to.
        hints.correction = Correction::NONE;
        let loaded: Result<Vec<Loaded>, Error> = self
            .inputs
            .iter()
            .map(|input| Ok(Opened::new(input, self.format)?.read(&hints)?))
            .collect();
        let loaded = loaded?;
        loaded.iter().for_each(|loaded| tell(&loaded.notices));
        let sensor = SensorCalibration::of(loaded.iter().map(|loaded| &loaded.recording))
            .map_err(CalibrationError::from)?;
        self.hand_over(configuration, &sensor, |file| file.set_sensor(&sensor))
    }

    fn hand_over(
        &self,
        configuration: &Configuration,
        report: &(impl Serialize + Display),
        set: impl FnOnce(&mut RobotFile),
    ) -> Result<(), Error> {
        if let Some(path) = &self.output {
            let mut file = RobotFile::keeping(&configuration.text).map_err(|error| {
                ConfigError::Unreadable {
                    file: configuration.name.clone().unwrap_or_default(),
                    source: io::Error::other(error),
                }
            })?;
            set(&mut file);
            write_file(path, |to| to.write_all(file.text().as_bytes()))?;
        }
        let style = if self.json {
            SummaryStyle::Json
        } else {
            SummaryStyle::Text
        };
        print(report, style, self.output.iter().chain(&self.plot)).map_err(Error::Print)
    }
}
