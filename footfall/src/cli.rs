//! The command line: one sub-command a task, and `footfall demo` where none is named.

mod attitude;
mod calibrate;
mod recording;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use estimator_core::WindowLength;
use wire::NodeId;

pub use attitude::AttitudeArguments;
pub use calibrate::CalibrateArguments;
pub use recording::RecordingArguments;

use crate::config::parse_window;
use crate::decode::{self, row::write_rows};
use crate::demo;
use crate::error::Error;
use crate::evaluate::{self, Evaluation, table::Style};
use crate::input::Opened;
use crate::output::write_file;
use crate::replay::replay;
use crate::report::{Outputs, SummaryStyle, hand_over, print, print_json, print_text, tell};
use crate::targets;
use recording::Configuration;

/// How probable it is that a robot's foot stands firmly, from the IMU on it
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = false)]
pub struct Arguments {
    /// What to do; `demo` where nothing is said.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What can be done.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Replay a recording: probabilities to a table, a picture and a summary
    Replay(ReplayArguments),
    /// Make a walking foot with a simulated LSM6DSOX, estimate, and write that and what the foot
    /// sends of it; needs no files
    Demo(DemoArguments),
    /// Turn what a foot has sent, a log of candump -l or a recording of its serial line, into rows,
    /// and report what is missing or damaged
    Decode(DecodeArguments),
    /// Score this estimator and the methods of others on all recordings that have labels, and on
    /// simulated walks
    #[command(after_help = evaluate::sets::wanted())]
    Evaluate(EvaluateArguments),
    /// Score the orientation against the truth in the columns qw,qx,qy,qz of recordings
    Attitude(AttitudeArguments),
    /// Let the estimator learn a foot from recordings, for a warm start; or with --rests find what is
    /// wrong with the sensor
    Calibrate(CalibrateArguments),
}

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

/// What `footfall demo` takes.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Where samples.csv, plot.svg, can.log and uart.bin go; made where it does not exist
    #[arg(long, value_name = "DIR", default_value = demo::DIRECTORY)]
    pub out: PathBuf,
    /// What the sensor's noise and the foot's slips are drawn from: the same seed, the same walk
    #[arg(long, default_value_t = demo::SEED)]
    pub seed: u64,
}

/// What `footfall decode` takes.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// The log or recording; which of the two it is, its contents tell
    pub input: PathBuf,
    /// On CAN, a node that is a foot beside those of the ids 0x11 to 0x16; may be repeated
    #[arg(long = "node", value_name = "ID", value_parser = parse_node)]
    pub nodes: Vec<NodeId>,
    /// Write the rows, one per contact frame
    #[arg(long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// What `footfall evaluate` takes.
#[derive(Debug, Args)]
pub struct EvaluateArguments {
    /// The folder with pce/, lcd/ and pyshoe/ in it
    #[arg(long, value_name = "DIR", env = "FOOTFALL_DATASETS", default_value = evaluate::DATASETS)]
    pub datasets: PathBuf,
    /// Print the tables in Markdown
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Print everything as one JSON object
    #[arg(long)]
    pub json: bool,
    /// Draw the distribution of |P - label|, of this estimator and of fuzzy c-means
    #[arg(long, value_name = "OUT.svg")]
    pub histogram: Option<PathBuf>,
    /// Draw how often P comes true
    #[arg(long, value_name = "OUT.svg")]
    pub reliability: Option<PathBuf>,
}

/// A node id, decimal or with 0x hexadecimal.
fn parse_node(text: &str) -> Result<NodeId, &'static str> {
    let id = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16),
        None => text.parse(),
    };
    id.ok()
        .and_then(NodeId::new)
        .ok_or("write a node id, 1 to 127 or 0x01 to 0x7F")
}

impl Default for DemoArguments {
    fn default() -> Self {
        Self {
            out: demo::DIRECTORY.into(),
            seed: demo::SEED,
        }
    }
}

impl Arguments {
    /// Does what was asked.
    ///
    /// # Errors
    /// The first thing that stands in the way.
    pub fn run(self) -> Result<(), Error> {
        let command = self
            .command
            .unwrap_or_else(|| Command::Demo(DemoArguments::default()));
        match command {
            Command::Replay(arguments) => arguments.run(),
            Command::Demo(DemoArguments { out, seed }) => demo::run(&out, seed),
            Command::Decode(arguments) => arguments.run(),
            Command::Evaluate(arguments) => arguments.run(),
            Command::Attitude(arguments) => arguments.run(),
            Command::Calibrate(arguments) => arguments.run(),
        }
    }
}

impl ReplayArguments {
    fn run(self) -> Result<(), Error> {
        let configuration = Configuration::read(self.recording.config.as_deref())?;
        let opened = Opened::new(&self.input, self.recording.format)?;
        let format = opened.format();
        let mut params = self.recording.params(&configuration, format);
        if let Some(window) = self.window {
            params.window = window;
        }
        targets::check(&self.input, self.output.as_deref(), self.plot.as_deref())?;
        let loaded = opened.read(&self.recording.hints(&configuration)?)?;
        loaded.notices.iter().for_each(tell);
        let outputs = Outputs {
            samples: None,
            estimates: self.output,
            plot: self.plot,
            others: Vec::new(),
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
            tell(notice);
        }
        let estimates =
            replay(&loaded.recording, &params).map_err(|error| origins.explain(&error, &params))?;
        hand_over(&outputs, &loaded.recording, loaded.start_us, &estimates)
    }
}

impl DecodeArguments {
    fn run(&self) -> Result<(), Error> {
        targets::check(&self.input, self.output.as_deref(), None)?;
        let decoded = decode::read(&self.input, &self.nodes)?;
        decoded.notices.iter().for_each(tell);
        if let Some(path) = &self.output {
            write_file(path, |to| write_rows(&decoded.rows, to))?;
        }
        let style = if self.json {
            SummaryStyle::Json
        } else {
            SummaryStyle::Text
        };
        print(&decoded.report, style, &self.output).map_err(Error::Print)
    }
}

impl EvaluateArguments {
    fn run(&self) -> Result<(), Error> {
        targets::check_pictures(self.histogram.as_deref(), self.reliability.as_deref())?;
        let evaluation = Evaluation::run(&self.datasets)?;
        if let Some(path) = &self.histogram {
            write_file(path, |to| to.write_all(evaluation.histogram()?.as_bytes()))?;
        }
        if let Some(path) = &self.reliability {
            write_file(path, |to| {
                to.write_all(evaluation.reliability()?.as_bytes())
            })?;
        }
        if self.json {
            print_json(&evaluation)
        } else if self.markdown {
            print_text(&evaluation.full_tables(Style::Markdown))
        } else {
            print_text(&evaluation.full_tables(Style::Text))
        }
        .map_err(Error::Print)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn nothing_at_all_means_demo() {
        let arguments = Arguments::parse_from(["footfall"]);
        assert!(arguments.command.is_none());
    }
}
