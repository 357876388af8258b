//! `virtual-board run`: boots an ELF, lets it run, and writes down what came out.

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::{Args, Parser, Subcommand};
use footfall::gait::GaitName;
use footfall::input::{Hints, Opened};
use lsm6dsox::sim::Fault as SensorFault;
use virtual_board::board::{Board, BoardOptions, Fault};
use virtual_board::chip::ChipOptions;
use virtual_board::part::can::BusFault;
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
    /// A simulated gait that the sensor feels: stand, walk, trot or run.
    #[arg(long, default_value = "walk")]
    gait: GaitName,
    /// Virtual time to run for; of a recording its length.
    #[arg(long)]
    seconds: Option<f64>,
    /// What goes wrong, and when in ms: NAME@MS; the name `help` lists all.
    #[arg(long = "fault", value_parser = fault)]
    faults: Vec<(String, Option<Fault>, u64)>,
    /// The gait's and the sensor's seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where to write.
    #[arg(long)]
    out: PathBuf,
    /// Have the board send all that it can: contact and raw sample each ms over the serial line,
    /// health each 10 ms.
    #[arg(long)]
    all_streams: bool,
    /// Write instructions a millisecond, one line a function, to this file.
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
}

/// Faults by name. `None` is one of the board's making, in force from the start.
fn faults() -> Vec<(&'static str, Option<Fault>)> {
    use SensorFault as S;
    vec![
        ("miso-low", Some(Fault::Sensor(S::MisoStuckLow))),
        ("miso-high", Some(Fault::Sensor(S::MisoStuckHigh))),
        (
            "bit-flips",
            Some(Fault::Sensor(S::BitFlips { per_million: 1000 })),
        ),
        ("wrong-id", Some(Fault::Sensor(S::WrongId(0x6B)))),
        ("sensor-reset", Some(Fault::Sensor(S::Reset))),
        ("data-ready-lost", Some(Fault::Sensor(S::DataReadyLost))),
        (
            "data-ready-storm",
            Some(Fault::Sensor(S::DataReadyStorm { period_ns: 10_000 })),
        ),
        ("frozen", Some(Fault::Sensor(S::FrozenOutput))),
        ("saturated", Some(Fault::Sensor(S::Saturation))),
        ("clock-fast", Some(Fault::Sensor(S::ClockRatio(1.05)))),
        ("clock-slow", Some(Fault::Sensor(S::ClockRatio(0.95)))),
        ("no-acknowledge", Some(Fault::Bus(BusFault::NoAcknowledge))),
        ("bus-shorted", Some(Fault::Bus(BusFault::Shorted))),
        ("bus-saturated", Some(Fault::Bus(BusFault::Saturated))),
        ("brown-out", Some(Fault::BrownOut)),
        ("reset", Some(Fault::Reset)),
        ("power-cut-in-flash", Some(Fault::CutInFlash(1))),
        ("hard-fault", Some(Fault::Derail)),
        ("hang", Some(Fault::Hang)),
        ("clear", Some(Fault::Clear)),
        ("no-crystal", None),
    ]
}

fn fault(text: &str) -> Result<(String, Option<Fault>, u64), String> {
    let names = || {
        faults()
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let Some((name, ms)) = text.split_once('@') else {
        return Err(format!("NAME@MS, the name one of {}", names()));
    };
    let ms = ms.parse().map_err(|_| format!("{ms} is no time in ms"))?;
    faults()
        .into_iter()
        .find(|(known, _)| *known == name)
        .map(|(known, fault)| (known.to_owned(), fault, ms))
        .ok_or_else(|| format!("{name} is none of {}", names()))
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
    if let Some(sensor) = &mut options.sensor {
        sensor.seed = arguments.seed;
    }
    if arguments
        .faults
        .iter()
        .any(|(name, _, _)| name == "no-crystal")
    {
        options.chip = ChipOptions { crystal: None };
    }
    let (mut board, seconds) = match &arguments.input {
        Some(input) => {
            let loaded = Opened::new(input, None)?.read(&Hints::default())?;
            let recording = motion::recording(&loaded.recording)?;
            let seconds = arguments.seconds.unwrap_or(recording.duration());
            (Board::with_motion(&elf, options, recording)?, seconds)
        }
        None => {
            let seconds = arguments.seconds.unwrap_or(10.0);
            let gait = motion::gait(arguments.gait, seconds, arguments.seed);
            (Board::with_motion(&elf, options, gait)?, seconds)
        }
    };
    let run = report::Run {
        milliseconds: (seconds * 1000.0).max(0.0) as u64,
        faults: arguments
            .faults
            .iter()
            .filter_map(|(name, fault, ms)| Some((name.clone(), (*fault)?, *ms)))
            .collect(),
    };
    if arguments.all_streams {
        streams::turn_all_on(&mut board)?;
    }
    let report = report::run(&mut board, &run, &arguments.out)?;
    if let Some(file) = &arguments.profile {
        std::fs::write(file, report::profile(&board, run.milliseconds))?;
    }
    println!("{report:#}");
    Ok(())
}

/// Builds the firmware and says where it is.
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
