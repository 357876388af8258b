//! `footfall replay`: a recording through the estimator, to a table, a picture and a summary.

use std::path::PathBuf;

use clap::Args;
use estimator_core::WindowLength;
use recordings::plausible;

use super::recording::{Configuration, RecordingArguments};
use crate::config::parse_window;
use crate::error::Error;
use crate::progress;
use crate::report::{Outputs, SummaryStyle, warn, write_outputs};
use crate::summary::InputReport;
use crate::targets;

/// What `footfall replay` takes.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// The recording
    pub input: PathBuf,
    /// How it is read, and with which parameters.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Length of the window: a duration such as 50ms or a count such as 50samples; with half-widths
    /// only, as with --preset paper
    #[arg(long, value_name = "LENGTH", value_parser = parse_window)]
    pub window: Option<WindowLength>,
    /// Write the estimates, one row per sample
    #[arg(long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Write the figure, which is an SVG
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl ReplayArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let configuration = Configuration::read(self.recording.config.as_deref())?;
        let opened = progress::open(&self.input, self.recording.format)?;
        let format = opened.format();
        let mut params = self.recording.params(&configuration, format);
        if let Some(window) = self.window {
            params.window = window;
        }
        targets::check(&self.input, self.output.as_deref(), self.plot.as_deref())?;
        let loaded = opened.read(&self.recording.hints(&configuration)?)?;
        loaded.notices.iter().for_each(warn);
        let mut outputs = Outputs {
            samples: None,
            estimates: self.output,
            plot: self.plot,
            others: Vec::new(),
            input: None,
            summary: if self.json {
                SummaryStyle::Json
            } else {
                SummaryStyle::Text
            },
        };
        let file = self.input.display().to_string();
        let origins = configuration.origins(&file, self.recording.sample_rate, self.window);
        origins.check_effects(&params)?;
        let preset = self.recording.preset;
        if let Some(notice) = preset.window_notice(format, &params, &loaded.recording) {
            warn(notice);
        }
        let estimates = progress::replay(&loaded.recording, &params)
            .map_err(|error| origins.explain(&error, &params))?;
        let findings = plausible::check(&loaded.recording);
        self.recording.report(&file, &findings)?;
        outputs.input = Some(InputReport::of(&loaded, &findings));
        write_outputs(&outputs, &loaded.recording, loaded.start_us, &estimates)
    }
}
