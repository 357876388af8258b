//! The command line: one command a file, and `footfall demo` where none is named.
//!
//! | command | file |
//! |---|---|
//! | `replay` | [`replay`] |
//! | `demo` | [`demo`] |
//! | `decode` | [`decode`] |
//! | `evaluate` | [`evaluate`] |
//! | `attitude` | [`attitude`] |
//! | `calibrate` | [`calibrate`] |
//! | what the commands that read recordings share | [`recording`] |

pub mod attitude;
pub mod calibrate;
pub mod decode;
pub mod demo;
pub mod evaluate;
pub mod recording;
pub mod replay;

use clap::{Parser, Subcommand};

use crate::error::Error;
use attitude::AttitudeArguments;
use calibrate::CalibrateArguments;
use decode::DecodeArguments;
use demo::DemoArguments;
use evaluate::EvaluateArguments;
use replay::ReplayArguments;

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
    /// Turn what a foot has sent, a log of its CAN frames or a recording of its serial line, into
    /// rows, and report what is missing or damaged
    Decode(DecodeArguments),
    /// Score this estimator and the methods of others on all recordings that have labels, and on
    /// simulated walks
    #[command(after_help = scoring::sets::needed())]
    Evaluate(EvaluateArguments),
    /// Score the orientation against the truth in the columns qw,qx,qy,qz of recordings
    Attitude(AttitudeArguments),
    /// Let the estimator learn a foot from recordings, for a warm start; or with --rests find what is
    /// wrong with the sensor
    Calibrate(CalibrateArguments),
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
            Command::Demo(arguments) => arguments.run(),
            Command::Decode(arguments) => arguments.run(),
            Command::Evaluate(arguments) => arguments.run(),
            Command::Attitude(arguments) => arguments.run(),
            Command::Calibrate(arguments) => arguments.run(),
        }
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
