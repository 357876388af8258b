//! Scenarios: a fault is injected into the running board, and every frame that the board sends is
//! watched. The outcome tells how soon the fault is detected, which reports are sent, when the board has
//! recovered, and whether any frame said "stable" on invalid data.
//!
//! | step | where |
//! |---|---|
//! | the scenarios: rows of the fault matrix, names on the command line | `list`, [`ALL`] |
//! | settings pages in which the next store has to erase | `pages` |
//! | prepare, inject, clear, wait for recovery: [`Scenario::run`] | here |
//! | record everything the board sends | `watch` |
//! | measure it against the scenario, and compare it with the requirements | `outcome`, [`ScenarioOutcome`] |
//! | run all of them; the figures of an outcome | `matrix` |
//! | two scenarios at once | [`pairs`] |

mod list;
mod matrix;
mod outcome;
mod pages;
pub mod pairs;
mod watch;

use lsm6dsox::sim::Stimulus;
use thiserror::Error;
use wire::dictionary::{self, index};
use wire::node::NmtCommand;
use wire::uart::{self, ConfigGet, ConfigSet, Message, NmtRequest};
use wire::{Address, Value};

pub use list::{ALL, CLEAR};
pub use matrix::{figures, matrix};
pub use outcome::ScenarioOutcome;
pub use pages::Pages;

use crate::emulator::board::{Board, BoardOptions, Injection};
use crate::emulator::corner::Corner;
use crate::emulator::failure::Failure;
use crate::emulator::part::can::BusFrame;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::{PER_SECOND, from_us};
use watch::Watch;

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Time by which preparing steps are done, ms. The board has started by then.
pub const BEFORE_MS: u64 = 300;

/// Time at which the matrix injects, ms. The foot stands and reports "stable" by then.
const AT_MS: u64 = 1000;

/// Minimum time for which the board is watched after its recovery, ms. The next health message comes within this time.
const AFTERWARDS_MS: u64 = 150;

/// One action on the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScenarioStep {
    /// Injects a fault, or clears faults.
    Inject(Injection),
    /// Changes a setting over the serial line.
    Set(Address, Value),
    /// Stores the settings in the current node state.
    Store,
    /// Stores the settings in pre-operational state.
    StoreStopped,
    /// Erases the stored settings in pre-operational state.
    Restore,
    /// Cuts the supply in the store that erases, after this many 32nds of its operations.
    CutInErase(u32),
    /// Sends a network management command of the master over the serial line.
    Nmt(NmtCommand),
    /// Waits, µs.
    Wait(u32),
    /// Requests a setting over the serial line.
    Request(Address),
    /// Sends this many meaningless bytes over the serial line.
    Garbage(u32),
    /// Sends this many requests over CAN, and as many over the serial line, at the full rate.
    Flood(u32),
}

/// Period of invalid data, in addition to the time from a reset of the board to its first sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// Never: the sensor and its measurements are not affected. No frame that is later than usual by
    /// more than [`MAX_LATE_MS`](Self::MAX_LATE_MS) says "stable".
    Never,
    /// Until the fault is cleared.
    UntilCleared,
    /// Until the first sample is read that was acquired after the injection and after a reset.
    UntilNextSample,
}

impl Invalid {
    /// Maximum delay beyond the usual one at which a frame may still say "stable", ms: the firmware drops frames
    /// that the bus did not accept within 20 ms.
    pub const MAX_LATE_MS: u64 = 21;
}

/// A fault, its injection, and the requirements on the board.
#[derive(Clone, Copy)]
pub struct Scenario {
    /// Name on the command line: `--fault NAME@MS`.
    pub name: &'static str,
    /// Description of the fault in the table.
    pub what: &'static str,
    /// Changes the options of the board for an injection at a time, µs.
    pub board: fn(&mut BoardOptions, u32),
    /// Steps that prepare the board.
    pub before: &'static [ScenarioStep],
    /// Motion of the foot, by seconds since the injection.
    pub motion: fn(f64) -> Stimulus,
    /// Content of the settings pages at power-up.
    pub pages: Pages,
    /// Steps of the injection, for each of the variants.
    pub steps: fn(u64) -> Vec<ScenarioStep>,
    /// Variants that the matrix runs: first, last, stride.
    pub variants: (u64, u64, u64),
    /// Whether the fault is present from power-up on.
    pub at_power_up: bool,
    /// Time until the fault is cleared, ms; `None` if it happens once or is permanent.
    pub lasts_ms: Option<u64>,
    /// Time limit for recovery and reports, ms, if the default does not fit.
    pub deadline_ms: Option<u64>,
    /// Period of invalid data.
    pub invalid: Invalid,
    /// Time for which the fault cannot be detected from the data, µs: afterwards no frame says "stable".
    pub blind_us: u64,
    /// Latest detection, µs after the injection.
    pub detected_within_us: u64,
    /// Number of runs, each at another phase of the sampling.
    pub phases: u64,
    /// Required report.
    pub reports: Reports,
    /// Whether CAN has to work again afterwards.
    pub with_can: bool,
    /// Whether both lines may be silent while data are invalid.
    pub may_be_silent: bool,
    /// Required resets, in order.
    pub resets: &'static [ResetCause],
    /// Whether other resets, or no reset, are allowed too.
    pub any_reset: bool,
    /// Whether the board's clock stops for a time.
    pub clock_stops: bool,
    /// Whether sample times have to continue undisturbed.
    pub keeps_time: bool,
    /// Time that the board's clock has to reach, µs.
    pub clock_beyond_us: u64,
    /// Setting that is read afterwards, with its old value and the one stored last.
    pub kept: Option<(Address, [Value; 2])>,
    /// Whether the new value is required, unless the board reports that it could not be stored.
    pub keeps_new: bool,
    /// Remark in the table beside the measurements.
    pub note: &'static str,
}

/// The report that a scenario requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reports {
    /// A fault, as an emergency message or over the serial line.
    Fault(wire::Fault),
    /// A counter in the health message.
    Counter(wire::Counter),
    /// The boot-up message alone.
    BootUp,
    /// No report, because the fault is within the board's tolerance.
    Nothing,
    /// Any report, or none.
    Any,
}

/// One run of a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Case {
    /// The variant.
    pub variant: u64,
    /// The phase of the sampling.
    pub phase: u64,
}

/// Reason why a scenario could not be run.
#[derive(Clone, Debug, Error)]
pub enum ScenarioError {
    /// The ELF does not fit the board.
    #[error("{0}")]
    Elf(String),
    /// The firmware misused the board.
    #[error(transparent)]
    Failure(#[from] Failure),
}

impl ScenarioStep {
    /// Carries out the step.
    pub fn act(self, board: &mut Board) {
        let send = |board: &mut Board, message: &Message| {
            board.push_uart(uart::encode(0, message).as_bytes());
        };
        let command = |index: u16, signature: u32| {
            let (address, value) = (Address::new(index, 1), Value::U32(signature).into());
            Message::ConfigSet(ConfigSet { address, value })
        };
        let restore = || command(index::RESTORE, dictionary::SIGNATURE_RESTORE);
        let store = || command(index::STORE, dictionary::SIGNATURE_STORE);
        let nmt = |command: NmtCommand| Message::Nmt(NmtRequest(command));
        let stopped = |board: &mut Board, message: &Message| {
            send(board, &nmt(NmtCommand::EnterPreOperational));
            send(board, message);
            send(board, &nmt(NmtCommand::StartRemoteNode));
        };
        match self {
            Self::Inject(injection) => board.inject(injection),
            Self::Set(address, value) => {
                let value = value.into();
                // Settings can be changed only while process data are stopped.
                stopped(board, &Message::ConfigSet(ConfigSet { address, value }));
            }
            Self::Store => send(board, &store()),
            Self::StoreStopped => stopped(board, &store()),
            Self::Restore => stopped(board, &restore()),
            Self::Nmt(command) => send(board, &nmt(command)),
            // The runner handles these, because they take time or depend on the pages.
            Self::Wait(_) | Self::CutInErase(_) => {}
            Self::Request(address) => send(board, &Message::ConfigGet(ConfigGet { address })),
            Self::Garbage(count) => {
                let bytes = (0..count).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
                board.push_uart(&bytes.collect::<Vec<u8>>());
            }
            Self::Flood(count) => {
                let address = Address::new(index::IDENTITY, 1);
                for _ in 0..count {
                    board.push_can(BusFrame::new(0x611, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
                    board.push_can(BusFrame::new(0x080, &[]));
                    send(board, &Message::ConfigGet(ConfigGet { address }));
                }
            }
        }
    }
}

impl Scenario {
    /// Returns the scenario with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|scenario| scenario.name == name)
    }

    /// Returns its variants.
    pub fn all_variants(&self) -> impl Iterator<Item = u64> {
        let (from, to, every) = self.variants;
        (from..=to).step_by(every.max(1) as usize)
    }

    /// Runs the scenario once on a new board at rest.
    ///
    /// # Errors
    /// If the ELF does not fit, or misuses the board.
    pub fn run(
        &self,
        elf: &[u8],
        case: Case,
        corner: Corner,
    ) -> Result<ScenarioOutcome, ScenarioError> {
        let Case { variant, phase } = case;
        self.run_steps(elf, &(self.steps)(variant), phase, corner)
    }

    /// Runs the scenario with other steps than its own.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_steps(
        &self,
        elf: &[u8],
        steps: &[ScenarioStep],
        phase: u64,
        corner: Corner,
    ) -> Result<ScenarioOutcome, ScenarioError> {
        let mut options = BoardOptions::default();
        options.set_corner(corner);
        let at_us = if self.at_power_up {
            0
        } else {
            // Strides that cover all of four ticks, at another phase each time.
            AT_MS * 1000 + phase * 1_283
        };
        (self.board)(&mut options, at_us as u32);
        let (motion, at_s) = (self.motion, at_us as f64 / 1.0e6);
        let mut board = Board::with_motion(elf, options, move |time: f64| motion(time - at_s))
            .map_err(|error| ScenarioError::Elf(error.to_string()))?;
        self.prepare(elf, &mut board)?;
        board.record_sensor_bus();
        let mut watch = Watch::default();
        let at = from_us(at_us);
        if !self.at_power_up {
            board.run_until(BEFORE_MS * MILLISECOND)?;
            for step in self.before {
                step.act(&mut board);
            }
            board.run_until(at)?;
            watch.take(&mut board);
        }
        for &step in steps {
            match step {
                ScenarioStep::Wait(us) => {
                    let until = board.now() + from_us(u64::from(us));
                    watch.run_until(&mut board, until)?;
                }
                ScenarioStep::CutInErase(part) => {
                    let operations = self.erasing_operations(elf)?;
                    let operation = 1 + u64::from(part) * operations.saturating_sub(1) / 31;
                    board.inject(Injection::CutInFlash(operation));
                }
                step => step.act(&mut board),
            }
        }
        let end = self.lasts_ms.map(|ms| at + ms * MILLISECOND);
        if let Some(end) = end {
            watch.run_until(&mut board, end)?;
            board.inject(Injection::Clear);
        }
        let latest = end.unwrap_or(at) + self.deadline() * MILLISECOND;
        let mut healthy_since = None;
        while board.now() < latest {
            let until = board.now() + 10 * MILLISECOND;
            watch.run_until(&mut board, until)?;
            let outcome = ScenarioOutcome::of(self, &watch, &board, at, end);
            if outcome.is_complete(self) {
                let since = *healthy_since.get_or_insert(board.now());
                if board.now() - since >= AFTERWARDS_MS * MILLISECOND {
                    break;
                }
            } else {
                healthy_since = None;
            }
        }
        let mut outcome = ScenarioOutcome::of(self, &watch, &board, at, end);
        if let Some((address, values)) = self.kept {
            ScenarioStep::Request(address).act(&mut board);
            let until = board.now() + 20 * MILLISECOND;
            watch.run_until(&mut board, until)?;
            outcome.take_setting(watch.answered(address), values);
        }
        outcome.violations = outcome::violations(self, &outcome);
        Ok(outcome)
    }

    /// The settings pages at its start.
    fn fill(&self, elf: &[u8]) -> Result<Option<pages::Filled>, ScenarioError> {
        match self.pages {
            Pages::Blank => Ok(None),
            Pages::BeforeAnErase => pages::before_an_erase(elf).map(Some),
        }
    }

    /// Number of flash operations in the store for which its pages are filled; 0 if they are blank.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn erasing_operations(&self, elf: &[u8]) -> Result<u64, ScenarioError> {
        Ok(self.fill(elf)?.map_or(0, |filled| filled.operations))
    }

    /// Fills the settings pages of a board that has not run yet, if the scenario requires it.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn prepare(&self, elf: &[u8], board: &mut Board) -> Result<(), ScenarioError> {
        if let Some(filled) = self.fill(elf)? {
            board.set_settings(&filled.bytes);
        }
        Ok(())
    }

    /// Returns whether data stay invalid to the end.
    fn stays(&self) -> bool {
        self.invalid == Invalid::UntilCleared && self.lasts_ms.is_none()
    }

    /// Time limit for recovery, ms.
    fn deadline(&self) -> u64 {
        let usual = if self.stays() { 1000 } else { 4000 };
        self.deadline_ms.unwrap_or(usual)
    }
}
