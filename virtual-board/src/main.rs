//! `virtual-board run`: boots an ELF, runs it, and writes its output to files.

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use gait::GaitName;
use recordings::input::Format;
use virtual_board::board::{Board, BoardOptions, Injection};
use virtual_board::corner::Corner;
use virtual_board::recorded;
use virtual_board::report::Action;
use virtual_board::scenario::{self, Scenario, Step};
use virtual_board::traffic::Traffic;
use virtual_board::{motion, report, streams};

/// Boots the very ELF that is flashed, on modelled peripherals, timing estimated.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Sub,
}

#[derive(Subcommand)]
enum Sub {
    /// Run an ELF and write uart.bin, can.log, samples.csv, plot.svg and report.json.
    Run(RunArguments),
}

#[derive(Args)]
struct RunArguments {
    /// The ELF; without it the firmware is built first.
    #[arg(long)]
    elf: Option<PathBuf>,
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
    #[arg(long = "fault", value_parser = fault)]
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
    /// `None` where faults are cleared.
    scenario: Option<&'static Scenario>,
    variant: u64,
    ms: u32,
}

/// Clears all that can be cleared.
const CLEAR: &str = "clear";

/// A day: more is taken as a mistake.
const MOST_SECONDS: f64 = 86_400.0;

/// Reads the name of a format; the help lists all of them.
fn format_parser() -> impl TypedValueParser<Value = Format> {
    PossibleValuesParser::new(Format::ALL.map(Format::name)).try_map(|name| name.parse::<Format>())
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds
        .filter(|seconds| (0.0..=MOST_SECONDS).contains(seconds))
        .ok_or_else(|| format!("write seconds from 0 to {MOST_SECONDS}"))
}

fn duration(text: &str) -> Result<f64, String> {
    let some = seconds(text).ok().filter(|seconds| *seconds > 0.0);
    some.ok_or_else(|| format!("write seconds above 0 and up to {MOST_SECONDS}"))
}

fn fault(text: &str) -> Result<Planned, String> {
    let names = || {
        let names = scenario::ALL.iter().map(|scenario| scenario.name);
        names.chain([CLEAR]).collect::<Vec<_>>().join(", ")
    };
    let Some((name, ms)) = text.split_once('@') else {
        return Err(format!("NAME@MS, the name one of {}", names()));
    };
    let ms = ms.parse().map_err(|_| format!("{ms} is no time in ms"))?;
    let (name, variant) = match name.split_once(':') {
        Some((name, variant)) => {
            let number = variant.parse();
            (
                name,
                Some(number.map_err(|_| format!("{variant} is no number"))?),
            )
        }
        None => (name, None),
    };
    let scenario = Scenario::named(name);
    if scenario.is_none() && name != CLEAR {
        return Err(format!("{name} is none of {}", names()));
    }
    Ok(Planned {
        text: text.to_owned(),
        scenario,
        variant: variant.unwrap_or_else(|| scenario.map_or(0, |found| found.variants.0)),
        ms,
    })
}

impl Planned {
    /// The actions, and when, ms; preparation comes first.
    fn actions(&self) -> Vec<Action> {
        let action = |ms: u64, step: Step| Action { ms, step };
        let ms = u64::from(self.ms);
        let Some(scenario) = self.scenario else {
            return vec![action(ms, Step::Inject(Injection::Clear))];
        };
        let before = scenario.before.iter();
        let before = before.map(|&step| action(ms.min(scenario::BEFORE_MS), step));
        let mut at_us = 1000 * ms;
        let steps = (scenario.steps)(self.variant).into_iter().map(|step| {
            let found = action(at_us / 1000, step);
            if let Step::Wait(us) = step {
                at_us += u64::from(us);
            }
            found
        });
        before.chain(steps).collect()
    }
}

fn main() -> ExitCode {
    let Sub::Run(arguments) = Cli::parse().command;
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &RunArguments) -> Result<(), Box<dyn core::error::Error>> {
    let path = match &arguments.elf {
        Some(path) => path.clone(),
        None => build()?,
    };
    let elf = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut options = BoardOptions::default();
    options.set_corner(arguments.corner);
    if let Some(sensor) = &mut options.sensor {
        sensor.seed = arguments.seed;
    }
    for planned in &arguments.faults {
        if let Some(scenario) = planned.scenario {
            (scenario.board)(&mut options, planned.ms.saturating_mul(1000));
        }
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
        if let Some(scenario) = planned.scenario {
            scenario.prepare(&elf, &mut board)?;
        }
    }
    let run = report::Run {
        milliseconds: (seconds * 1000.0) as u64,
        faults: arguments
            .faults
            .iter()
            .map(|planned| planned.text.clone())
            .collect(),
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

/// Builds the firmware and returns its path.
fn build() -> Result<PathBuf, String> {
    const TARGET: &str = "thumbv7em-none-eabihf";
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let directory = workspace.join("target/board");
    let status = Command::new("cargo")
        .current_dir(&workspace)
        .args([
            "build",
            "--release",
            "--locked",
            "-p",
            "firmware",
            "--bin",
            "foot",
        ])
        .args(["--target", TARGET, "--target-dir"])
        .arg(&directory)
        .status()
        .map_err(|error| format!("cargo does not start: {error}"))?;
    if !status.success() {
        return Err("the firmware does not build".into());
    }
    Ok(directory.join(TARGET).join("release/foot"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_has_a_name_a_time_and_perhaps_a_variant() {
        let planned = fault("power-cut:17@1000").expect("a fault");
        assert_eq!((planned.variant, planned.ms), (17, 1000));
        let actions = planned.actions();
        let times: Vec<u64> = actions.iter().map(|action| action.ms).collect();
        assert_eq!(times, [300, 300, 300, 1000, 1000], "settings come first");
        assert_eq!(
            actions.get(3).map(|action| action.step),
            Some(Step::Inject(Injection::CutInFlash(17)))
        );
        for text in ["frozen", "frozen@soon", "thawed@1000", "power-cut:x@1"] {
            assert!(fault(text).is_err(), "{text}");
        }
    }

    #[test]
    fn seconds_are_a_number_up_to_a_day_and_to_run_is_to_run_for_some() {
        assert_eq!((seconds("0"), seconds("2.5")), (Ok(0.0), Ok(2.5)));
        assert_eq!((duration("0").ok(), duration("2.5")), (None, Ok(2.5)));
        for text in ["-5", "nan", "inf", "86401", "soon", ""] {
            assert!(seconds(text).is_err() && duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_row_of_the_matrix_is_a_fault_of_the_command_line() {
        for row in scenario::ALL {
            assert!(fault(&format!("{}@1000", row.name)).is_ok(), "{}", row.name);
        }
        assert!(fault("clear@1300").is_ok());
    }
}
