//! `virtual-board serve`: an ELF at the speed of real time behind pseudo-terminals, or in lock step behind sockets.

use std::io::{self, BufRead as _, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use clap::Args;
use gait::GaitName;
use gait::control::MOST_FEET;
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::serve::pace::VirtualSpeed;
use virtual_board::product::serve::robot::{ControlNode, RobotOptions};
use virtual_board::product::serve::{self, BoardPrograms, Note, Passage, ServeSummary};

/// The options of `serve`.
#[derive(Args)]
pub struct ServeArguments {
    #[command(flatten)]
    elf: ElfArguments,
    /// The bootloader's ELF, as `cargo xtask bootloader BOARD` builds it; without it the program starts at once, and cannot be
    /// replaced. A power cycle brings the first program back.
    #[arg(long, value_name = "ELF")]
    bootloader: Option<PathBuf>,
    /// How many feet share the bus, 1 to 6; two are those of a biped.
    #[arg(long, default_value_t = 1, value_parser = feet)]
    feet: usize,
    /// How they walk: stand, walk, trot or run.
    #[arg(long, default_value = "walk")]
    gait: GaitName,
    /// Seed of the steps and of the noise of the sensors.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The specimen of the chip: fast, typical or slow, within what the data sheet allows.
    #[arg(long, default_value = "typical")]
    corner: Corner,
    /// Run only the feet on the bus, without a control that sends loads and SYNCs.
    #[arg(long)]
    no_control: bool,
    /// A directory for links to the terminals, or for the sockets: FL.uart …, bus.slcan.
    #[arg(long, value_name = "DIR")]
    links: Option<PathBuf>,
    /// Virtual time to run for; without it until `quit`, or Ctrl-C.
    #[arg(long, value_parser = duration, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// How many times as fast as real time, or max.
    #[arg(long, default_value = "1")]
    speed: VirtualSpeed,
    /// Sockets in the place of terminals: time passes only while each program at one of them waits.
    #[arg(long, requires = "links", conflicts_with = "speed")]
    lock_step: bool,
}

/// Options that choose the ELF.
#[derive(Args)]
struct ElfArguments {
    /// The ELF; without it the firmware is built first.
    #[arg(long)]
    elf: Option<PathBuf>,
    /// The board whose firmware is built: reference or feather. An ELF names its board.
    #[arg(long, default_value = "reference", value_parser = Wiring::named, conflicts_with = "elf")]
    board: &'static Wiring,
}

/// One day: a larger value is rejected as a mistake.
const MOST_SECONDS: f64 = 86_400.0;

/// Parses the number of feet.
fn feet(text: &str) -> Result<usize, String> {
    let feet = text.parse().ok();
    let feet = feet.filter(|feet| (1..=MOST_FEET).contains(feet));
    feet.ok_or_else(|| format!("write a number from 1 to {MOST_FEET}"))
}

/// Parses seconds, zero rejected.
fn duration(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds
        .filter(|seconds| *seconds > 0.0 && *seconds <= MOST_SECONDS)
        .ok_or_else(|| format!("write seconds above 0 and up to {MOST_SECONDS}"))
}

/// Serves feet until the end is requested.
pub fn serve(arguments: &ServeArguments) -> Result<(), Box<dyn core::error::Error>> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    ctrlc::set_handler(move || stopped.store(true, Ordering::Relaxed))?;
    let elf = arguments.elf.read()?;
    let bootloader = arguments.bootloader.as_deref().map(read).transpose()?;
    let programs = BoardPrograms { program: elf.into(), bootloader: bootloader.map(Into::into) };
    let control = if arguments.no_control { ControlNode::Absent } else { ControlNode::Present };
    let options = serve::ServeOptions {
        robot: RobotOptions {
            feet: arguments.feet,
            gait: arguments.gait,
            seed: arguments.seed,
            corner: arguments.corner,
            control,
            settings: Vec::new(),
        },
        links: arguments.links.clone(),
        ms: arguments.seconds.map(|seconds| (seconds * 1e3) as u64),
        passage: if arguments.lock_step {
            Passage::LockStep
        } else {
            Passage::Speed(arguments.speed)
        },
    };
    let mut report = |note: Note| match note {
        // A reader that has gone is not an error.
        Note::Source(name, source) => drop(writeln!(io::stdout(), "{name:<4} {source}")),
        Note::Ready => drop(io::stdout().flush()),
        Note::Text(text) => eprintln!("{text}"),
    };
    let summary = serve::serve(programs, &options, &typed(), &stop, &mut report)?;
    print(&summary);
    Ok(())
}

/// Lines of standard input, read by a separate thread. A background process that reads from its terminal is
/// stopped: then there are no lines.
fn typed() -> Receiver<String> {
    let (to, lines) = channel();
    let stdin = io::stdin();
    let is_in_background =
        stdin.is_terminal() && tcgetpgrp(&stdin).is_ok_and(|group| group != getpgrp());
    if !is_in_background {
        thread::spawn(move || {
            // A line that is not valid text is reported as an unknown command, and reading continues.
            for line in stdin.lock().split(b'\n') {
                let Ok(line) = line else { return };
                let line = String::from_utf8_lossy(&line).into_owned();
                if to.send(line).is_err() {
                    return;
                }
            }
        });
    }
    lines
}

/// Prints the duration of the run, and the losses.
fn print(summary: &ServeSummary) {
    let seconds = summary.ms as f64 * 1e-3;
    let took = summary.took.as_secs_f64();
    eprintln!("{seconds:.1} s in {took:.1} s: {:.2} times real time", seconds / took);
    let behind = summary.behind.as_secs_f64();
    if behind > 0.0 {
        eprintln!("slower than real time: {behind:.1} s lost");
    }
    for (name, bytes) in summary.lost.iter().filter(|(_, bytes)| *bytes > 0) {
        eprintln!("{name}: {bytes} bytes lost, since their reader was too slow");
    }
    if summary.lost_on_bus > 0 {
        eprintln!("bus: {} frames lost, since it was full", summary.lost_on_bus);
    }
}

impl ElfArguments {
    /// Reads the named ELF, or builds the firmware for the board.
    fn read(&self) -> Result<Vec<u8>, String> {
        match &self.elf {
            Some(path) => read(path),
            None => read(&build(self.board)?),
        }
    }
}

/// Reads an ELF.
fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Builds the firmware and returns its path.
fn build(board: &Wiring) -> Result<PathBuf, String> {
    const TARGET: &str = "thumbv7em-none-eabihf";
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let directory = workspace.join("target");
    let status = Command::new("cargo")
        .current_dir(&workspace)
        .args(["build", "--profile", "firmware", "--locked"])
        .args(board.cargo_arguments())
        .args(["--target", TARGET, "--target-dir"])
        .arg(&directory)
        .status()
        .map_err(|error| format!("cargo does not start: {error}"))?;
    if !status.success() {
        return Err("the firmware does not build".into());
    }
    Ok(directory.join(TARGET).join("firmware").join(board.program))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_above_zero_and_up_to_a_day() {
        assert_eq!(duration("2.5"), Ok(2.5));
        for text in ["0", "-5", "nan", "inf", "86401", "soon", ""] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
