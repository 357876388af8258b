//! Command line: one file per command; `footfall demo` is the default command.
//!
//! | command | file |
//! |---|---|
//! | `replay` | [`replay`] |
//! | `convert` | [`convert`] |
//! | `demo` | [`demo`] |
//! | `decode` | [`decode`] |
//! | `monitor` | [`monitor`] |
//! | `record` | [`record`] |
//! | `view` | [`view`] |
//! | `ros2` | `ros2` |
//! | `calibrate` | [`calibrate`] |
//! | `accept` | [`accept`] |
//! | `config` | [`config`] |
//! | `explain` | [`explain`] |
//! | `foot` | [`foot`] |
//! | `completions`, `man` | this one |
//! | options that commands share | [`options`], `span` |
//! | streaming feet, for `monitor`, `record`, `view` and `ros2` | [`stream`](crate::stream) |

pub mod accept;
pub mod calibrate;
pub mod config;
pub mod convert;
pub mod decode;
pub mod demo;
pub mod explain;
pub mod foot;
pub mod monitor;
pub mod options;
pub mod record;
pub mod replay;
#[cfg(feature = "ros2")]
pub mod ros2;
mod span;
pub mod view;

use std::path::PathBuf;

use clap::{ArgAction, Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;

use crate::error::Error;
use crate::files::{OutputError, create_directory};
use crate::messages::{Verbosity, set_verbosity};
use crate::report::print_text;

/// Examples of the program as a whole.
pub const EXAMPLES: &str = "\
Examples:
  footfall                                   simulate a walk, no files needed
  footfall replay walk.csv --plot walk.svg   estimate a recording, draw it
  footfall calibrate walk.csv --output robot.toml
  footfall config > robot.toml";

/// Meaning of the exit codes.
pub const EXIT_CODES: &str = "\
Exit codes:
  0    success, even if the reader of standard output has closed it (| head)
  1    failure; standard error gives the reason
  2    invalid command line
  130  interrupted; no unfinished file is left";

/// Examples of `footfall completions`.
pub const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  footfall completions bash > ~/.local/share/bash-completion/completions/footfall
  footfall completions zsh > \"${fpath[1]}/_footfall\"
  footfall completions fish > ~/.config/fish/completions/footfall.fish";

/// Examples of `footfall man`.
pub const MAN_EXAMPLES: &str = "\
Examples:
  footfall man ~/.local/share/man/man1
  man footfall";

/// Estimates the probability of stable contact of a robot's foot, from the IMU on it
#[derive(Debug, Parser)]
#[command(
    name = "footfall",
    version = crate::feature::version(),
    arg_required_else_help = false,
    max_term_width = 100,
    after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}")
)]
pub struct Arguments {
    /// Print nothing but errors on standard error
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print details on standard error: the recognised format, parameters that differ from the preset, and
    /// timings
    #[arg(short, long, global = true, action = ArgAction::SetTrue)]
    pub verbose: bool,
    /// Command; `demo` by default.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// Commands of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Estimate stable contact from recordings: a table of probabilities, a plot and a summary
    #[command(after_help = replay::EXAMPLES)]
    Replay(replay::ReplayArguments),
    /// Convert a recording from any format that replay reads to CSV, Parquet or MCAP
    #[command(after_help = convert::EXAMPLES)]
    Convert(convert::ConvertArguments),
    /// Simulate a walking foot with an LSM6DSOX, and write its samples, plot, CAN log and serial bytes;
    /// needs no input
    Demo(demo::DemoArguments),
    /// Decode the output of feet, a log of CAN frames or the bytes of a serial line, to rows, and report
    /// missing and damaged frames
    Decode(decode::DecodeArguments),
    /// Show streaming feet: probability, state, faults, rate and losses of each
    Monitor(monitor::MonitorArguments),
    /// Record streaming feet as MCAP for ROS 2: contacts, IMU, diagnostics
    Record(record::RecordArguments),
    /// Show streaming feet in viewers.
    #[command(
        about = "Show streaming feet in Foxglove and PlotJuggler, or print a layout for one of them",
        after_help = view::EXAMPLES
    )]
    View(view::ViewArguments),
    /// Publish streaming feet as a ROS 2 node, without a ROS installation: contacts, IMU, diagnostics
    Ros2(ros2::Ros2Arguments),
    /// Learn a foot from recordings, so that the estimator starts warm; or, with --rests, find the errors of
    /// the sensor
    #[command(after_help = calibrate::EXAMPLES)]
    Calibrate(calibrate::CalibrateArguments),
    /// Print a configuration file with the meaning, unit, range and preset value of every key; or check a
    /// file
    #[command(after_help = config::EXAMPLES)]
    Config(config::ConfigArguments),
    /// Query, configure, calibrate and update feet: scan, info, report, get, set, save, restore, diff, export, import,
    /// reset, id, calibrate, selftest, update
    Foot(foot::FootArguments),
    /// Measure a board step by step, with your help, and check each figure against its limits
    Accept(accept::AcceptArguments),
    /// Explain a fault, flag, refusal, state or finding, and what to do about it
    Explain(explain::ExplainArguments),
    /// Print a completion script for a shell
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArguments),
    /// Print the manual page, or write those of all commands to a folder
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArguments),
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    /// The first error.
    pub fn run(self) -> Result<(), Error> {
        set_verbosity(if self.quiet {
            Verbosity::Quiet
        } else if self.verbose {
            Verbosity::Verbose
        } else {
            Verbosity::Normal
        });
        match self.command.unwrap_or(Command::Demo(demo::DemoArguments::default())) {
            Command::Replay(arguments) => arguments.run(),
            Command::Convert(arguments) => arguments.run(),
            Command::Demo(arguments) => arguments.run(),
            Command::Decode(arguments) => arguments.run(),
            Command::Monitor(arguments) => arguments.run(),
            Command::Record(arguments) => arguments.run(),
            Command::View(arguments) => arguments.run(),
            Command::Ros2(arguments) => arguments.run(),
            Command::Calibrate(arguments) => arguments.run(),
            Command::Config(arguments) => arguments.run(),
            Command::Foot(arguments) => arguments.run(),
            Command::Accept(arguments) => arguments.run(),
            Command::Explain(arguments) => arguments.run(),
            Command::Completions(arguments) => arguments.run(),
            Command::Man(arguments) => arguments.run(),
        }
    }
}

/// Arguments of `footfall completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

impl CompletionsArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "footfall", &mut script);
        print_text(&String::from_utf8_lossy(&script)).map_err(Error::Print)
    }
}

/// Arguments of `footfall man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder for the pages of all commands, such as `footfall-replay.1`; created if it does not exist
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

impl ManArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let command = Arguments::command();
        let Some(folder) = &self.folder else {
            let mut page = Vec::new();
            // Writing to memory does not fail.
            let _ = clap_mangen::Man::new(command).render(&mut page);
            return print_text(&String::from_utf8_lossy(&page)).map_err(Error::Print);
        };
        create_directory(folder)?;
        let written = clap_mangen::generate_to(command, folder);
        Ok(written.map_err(OutputError::unwritable(folder))?)
    }
}

/// The command `ros2` where it is not built.
#[cfg(not(feature = "ros2"))]
mod ros2 {
    use std::ffi::OsString;

    use clap::Args;

    use crate::error::Error;
    use crate::feature::Feature;

    /// Any arguments of `footfall ros2`: the error is that the feature is missing.
    #[derive(Debug, Args)]
    #[command(disable_help_flag = true)]
    pub struct Ros2Arguments {
        /// Arguments, which are ignored.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        pub all: Vec<OsString>,
    }

    impl Ros2Arguments {
        pub(super) fn run(&self) -> Result<(), Error> {
            Err(Feature::Ros2.missing_for("footfall ros2").into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn help_of_the_program_names_each_action_of_a_foot() {
        let command = Arguments::command();
        let foot = command.find_subcommand("foot").expect("the command");
        let about = foot.get_about().expect("a line").to_string();
        let (_, listed) = about.split_once(": ").expect("a list");
        let listed: Vec<&str> = listed.split(", ").collect();
        let actions = foot.get_subcommands().map(clap::Command::get_name);
        for action in actions.filter(|action| *action != "help") {
            assert!(listed.contains(&action), "{action} is not in {about:?}");
        }
    }
}
