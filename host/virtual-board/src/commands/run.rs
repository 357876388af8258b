//! `virtual-board run`: boots an ELF, runs it, and writes its output to files.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use gait::GaitName;
use recordings::input::Format;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::corner::Corner;
use virtual_board::product::fault::SelectedFault;
use virtual_board::product::recorded;
use virtual_board::product::report::TimedStep;
use virtual_board::product::scenario;
use virtual_board::product::traffic::Traffic;
use virtual_board::product::{motion, report, streams};

use super::elf;
use super::options::{duration, fault_at, seconds};

/// The options of `run`.
#[derive(Args)]
pub struct RunArguments {
    #[command(flatten)]
    elf: elf::ElfArguments,
    /// A recording that the sensor feels, resampled by straight lines.
    #[arg(long, conflicts_with = "gait")]
    input: Option<PathBuf>,
    /// How the recording is laid out, where its header does not name the columns.
    #[arg(long, requires = "input", value_parser = format_parser())]
    layout: Option<Format>,
    /// Seconds of the recording that are left out at its beginning.
    #[arg(long, requires = "input", default_value_t = 0.0, value_parser = seconds,
        allow_negative_numbers = true)]
    skip: f64,
    /// A simulated gait that the sensor feels: stand, walk, trot or run.
    #[arg(long, default_value = "walk")]
    gait: GaitName,
    /// Virtual time to run for; of a recording its length.
    #[arg(long, value_parser = duration, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// A fault to inject, and when in ms: NAME@MS, or NAME:VARIANT@MS; `clear` clears all that can be cleared.
    /// The name `help` lists all.
    #[arg(long = "fault", value_parser = planned)]
    faults: Vec<Planned>,
    /// The gait's and the sensor's seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The specimen of the chip: fast, typical or slow, within what the data sheet allows.
    #[arg(long, default_value = "typical")]
    corner: Corner,
    /// Everything on: raw samples too, three more feet on the bus, and questions over both lines.
    #[arg(long)]
    full_load: bool,
    /// Where to write.
    #[arg(long, default_value = "target/virtual-board")]
    out: PathBuf,
    /// Have the board send all that it can: contact and raw sample each ms over the serial line,
    /// health each 10 ms.
    #[arg(long)]
    all_streams: bool,
    /// Write instructions and cycles of waiting for flash a millisecond, one line a function, to
    /// this file.
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
}

/// A fault of the command line.
#[derive(Clone)]
struct Planned {
    text: String,
    fault: SelectedFault,
    ms: u32,
}

/// Reads the name of a format; the help lists all of them.
fn format_parser() -> impl TypedValueParser<Value = Format> {
    PossibleValuesParser::new(Format::ALL.map(Format::name)).try_map(|name| name.parse::<Format>())
}

fn planned(text: &str) -> Result<Planned, String> {
    let (fault, ms) = fault_at(text)?;
    let text = text.to_owned();
    Ok(Planned { text, fault, ms })
}

impl Planned {
    /// Actions with their times, ms; preparation comes first.
    fn actions(&self) -> Vec<TimedStep> {
        let ms = u64::from(self.ms);
        let before = self.fault.scenario.before.iter().map(|&step| TimedStep {
            ms: ms.min(scenario::BEFORE_MS),
            step,
        });
        let steps = self.fault.steps().into_iter().map(|(us, step)| TimedStep {
            ms: ms + us / 1000,
            step,
        });
        before.chain(steps).collect()
    }
}

/// Runs the board and writes its files.
pub fn run(arguments: &RunArguments) -> Result<(), Box<dyn core::error::Error>> {
    let elf = arguments.elf.read()?;
    let mut options = BoardOptions::default();
    options.set_corner(arguments.corner);
    if let Some(sensor) = &mut options.sensor {
        sensor.seed = arguments.seed;
    }
    for planned in &arguments.faults {
        let at_us = planned.ms.saturating_mul(1000);
        (planned.fault.scenario.board)(&mut options, at_us);
    }
    let (mut board, seconds) = match &arguments.input {
        Some(input) => {
            let recording = recorded::read(input, arguments.layout, arguments.skip)?;
            let seconds = arguments.seconds.unwrap_or(recording.duration());
            (Board::with_motion(&elf, options, recording)?, seconds)
        }
        None => {
            let seconds = arguments.seconds.unwrap_or(10.0);
            let gait = motion::gait(arguments.gait, seconds, arguments.seed);
            (Board::with_motion(&elf, options, gait)?, seconds)
        }
    };
    for planned in &arguments.faults {
        planned.fault.scenario.prepare(&elf, &mut board)?;
    }
    let faults = arguments.faults.iter();
    let run = report::RunOptions {
        milliseconds: (seconds * 1000.0) as u64,
        faults: faults.map(|planned| planned.text.clone()).collect(),
        actions: arguments.faults.iter().flat_map(Planned::actions).collect(),
        traffic: match arguments.full_load {
            true => Traffic::Full,
            false => Traffic::Own,
        },
    };
    if arguments.all_streams {
        streams::turn_all_on(&mut board)?;
    }
    let began = Instant::now();
    let report = report::run(&mut board, &run, &arguments.out)?;
    if let Some(file) = &arguments.profile {
        std::fs::write(file, report::profile(&board, run.milliseconds))?;
    }
    println!("{report:#}");
    let took = began.elapsed().as_secs_f64();
    let seconds = run.milliseconds as f64 / 1.0e3;
    eprintln!(
        "{seconds:.1} s in {took:.1} s: {:.1} times real time",
        seconds / took
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use virtual_board::emulator::board::Injection;
    use virtual_board::product::scenario::ScenarioStep;

    #[test]
    fn preparing_steps_come_first() {
        let planned = planned("power-cut:17@1000").expect("a fault");
        let actions = planned.actions();
        let times: Vec<u64> = actions.iter().map(|action| action.ms).collect();
        assert_eq!(times, [300, 300, 300, 1000, 1000], "settings come first");
        assert_eq!(
            actions.get(3).map(|action| action.step),
            Some(ScenarioStep::Inject(Injection::CutInFlash(17)))
        );
    }
}
