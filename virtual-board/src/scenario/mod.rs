//! Something goes wrong on the running board, and every frame that it sends is watched: how soon
//! it is noticed, what is told, when all is well again, and whether any frame said "stable" while
//! the data behind it were invalid.
//!
//! [`ALL`] is the list of what can go wrong: rows of the fault matrix, and names on the program's
//! command line.

mod judge;
mod list;
mod outcome;
mod pages;
pub mod pairs;
mod table;
mod watch;

use lsm6dsox::sim::Stimulus;
use wire::dictionary::{self, index};
use wire::node::Command;
use wire::uart::{self, ConfigGet, ConfigSet, Message, NmtRequest};
use wire::{Address, Value};

pub use list::ALL;
pub use outcome::Outcome;
pub use pages::Pages;
pub use table::{HEAD, matrix, row};

use crate::board::{Board, BoardOptions, Injection};
use crate::corner::Corner;
use crate::failure::Failure;
use crate::part::can::Frame;
use crate::part::rcc::ResetCause;
use crate::time::{PER_SECOND, from_us};
use watch::Watch;

const MILLISECOND: u64 = PER_SECOND / 1000;

/// When steps that come before are done: the board has started.
pub const BEFORE_MS: u64 = 300;

/// When it happens in the matrix: the foot stands and says "stable" by then, ms.
const AT_MS: u64 = 1000;

/// How long the board is watched at the least once all is well again, ms: the next health message
/// comes within it.
const AFTERWARDS_MS: u64 = 150;

/// One thing that is done to the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Something goes wrong.
    Inject(Injection),
    /// A setting is changed over the serial line.
    Set(Address, Value),
    /// Settings are stored, as things are.
    Store,
    /// Settings are stored in pre-operational.
    StoreStopped,
    /// The stored settings are forgotten, in pre-operational.
    Restore,
    /// The supply fails in the store that erases, after so many 32ths of its operations.
    CutInErase(u32),
    /// The master commands something over the serial line.
    Nmt(Command),
    /// Nothing, for so many µs.
    Wait(u32),
    /// A setting is asked for over the serial line.
    Ask(Address),
    /// So many bytes without any meaning come over the serial line.
    Garbage(u32),
    /// So many questions come over CAN, and as many over the serial line, as fast as they go.
    Flood(u32),
}

/// When data are invalid, beside the time from a reset of the board to its first sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// Never: the sensor and what it measures are as before. No frame that is later than usual by
    /// more than [`MAX_LATE_MS`](Self::MAX_LATE_MS) says "stable".
    Never,
    /// Until what is wrong ends.
    UntilCleared,
    /// Until a sample is read again that came after it and after a reset.
    UntilNextSample,
}

impl Invalid {
    /// How much later than usual a frame may be and still say "stable", ms: the firmware gives up
    /// what the bus did not take in 20 ms.
    pub const MAX_LATE_MS: u64 = 21;
}

/// Something that can go wrong.
#[derive(Clone, Copy)]
pub struct Scenario {
    /// On the command line: `--fault NAME@MS`.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// How the board is made, for it to happen at a time, µs.
    pub board: fn(&mut BoardOptions, u32),
    /// What has to be so before.
    pub before: &'static [Step],
    /// What the foot does, so many seconds after it happens.
    pub motion: fn(f64) -> Stimulus,
    /// What is in the pages with the settings at power-up.
    pub pages: Pages,
    /// What is done, for each of its variants.
    pub steps: fn(u64) -> Vec<Step>,
    /// The variants that the matrix goes through: from, to, every so many.
    pub variants: (u64, u64, u64),
    /// Whether it is so from power-up.
    pub at_power_up: bool,
    /// How long it lasts, ms; `None` where it happens once or is there to stay.
    pub lasts_ms: Option<u64>,
    /// How long to wait for what is to come, ms, where that is not as usual.
    pub deadline_ms: Option<u64>,
    /// Until when data are invalid.
    pub invalid: Invalid,
    /// How long it cannot be seen in the data, µs: from then on no frame says "stable".
    pub blind_us: u64,
    /// How soon it is to be noticed, µs.
    pub detected_within_us: u64,
    /// Whether it hits another phase of the sampling each time, in so many runs.
    pub phases: u64,
    /// What is to be told.
    pub reports: Reports,
    /// Whether there is to be CAN again afterwards.
    pub with_can: bool,
    /// Whether both lines may be silent for as long as data are invalid.
    pub may_be_silent: bool,
    /// What the board is to be reset by.
    pub resets: &'static [ResetCause],
    /// Whether it may also be reset by something else, or not at all.
    pub any_reset: bool,
    /// Whether the board's clock stands still for a time.
    pub clock_stops: bool,
    /// Whether the times of the samples are to go on as if nothing were.
    pub keeps_time: bool,
    /// What the board's clock is to come to at the least, µs.
    pub clock_beyond_us: u64,
    /// A setting whose value is asked for afterwards, the value it had before and the one that was
    /// stored last.
    pub kept: Option<(Address, [Value; 2])>,
    /// Whether it is to be the new one, unless it is said that it could not be stored.
    pub keeps_new: bool,
    /// What is to be said of it in the table beside what was measured.
    pub note: &'static str,
}

/// What a scenario is to be told by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reports {
    /// A fault, as an emergency message or over the serial line.
    Fault(wire::Fault),
    /// A counter in the health message.
    Counter(wire::Counter),
    /// The boot-up message alone.
    BootUp,
    /// Nothing: it is within what the board takes.
    Nothing,
    /// Whatever there is to be told.
    Any,
}

/// One run of a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Case {
    /// Which of its variants.
    pub variant: u64,
    /// Which of its phases.
    pub phase: u64,
}

/// Why a scenario could not be run.
#[derive(Clone, Debug)]
pub enum Problem {
    /// The ELF does not fit the board.
    Elf(String),
    /// The firmware misused the board.
    Failure(Failure),
}

impl core::fmt::Display for Problem {
    fn fmt(&self, f: &mut core::fmt::Formatter) -> core::fmt::Result {
        match self {
            Self::Elf(text) => f.write_str(text),
            Self::Failure(failure) => failure.fmt(f),
        }
    }
}

impl core::error::Error for Problem {}

impl From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

impl Step {
    /// Does it.
    pub fn act(self, board: &mut Board) {
        let say = |board: &mut Board, message: &Message| {
            board.push_uart(uart::encode(0, message).as_bytes());
        };
        let command = |index: u16, signature: u32| {
            let (address, value) = (Address::new(index, 1), Value::U32(signature).into());
            Message::ConfigSet(ConfigSet { address, value })
        };
        let store = || command(index::STORE, dictionary::SIGNATURE_STORE);
        let restore = || command(index::RESTORE, dictionary::SIGNATURE_RESTORE);
        let stopped = |board: &mut Board, message: &Message| {
            say(
                board,
                &Message::Nmt(NmtRequest(Command::EnterPreOperational)),
            );
            say(board, message);
            say(board, &Message::Nmt(NmtRequest(Command::StartRemoteNode)));
        };
        match self {
            Self::Inject(injection) => board.inject(injection),
            Self::Set(address, value) => {
                let value = value.into();
                // Settings are changed while process data stand still.
                stopped(board, &Message::ConfigSet(ConfigSet { address, value }));
            }
            Self::Store => say(board, &store()),
            Self::StoreStopped => stopped(board, &store()),
            Self::Restore => stopped(board, &restore()),
            Self::Nmt(command) => say(board, &Message::Nmt(NmtRequest(command))),
            // For those who let time pass, and know the pages.
            Self::Wait(_) | Self::CutInErase(_) => {}
            Self::Ask(address) => say(board, &Message::ConfigGet(ConfigGet { address })),
            Self::Garbage(count) => {
                let bytes: Vec<u8> = (0..count)
                    .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
                    .collect();
                board.push_uart(&bytes);
            }
            Self::Flood(count) => {
                let address = Address::new(index::IDENTITY, 1);
                for _ in 0..count {
                    board.push_can(Frame::new(0x611, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
                    board.push_can(Frame::new(0x080, &[]));
                    say(board, &Message::ConfigGet(ConfigGet { address }));
                }
            }
        }
    }
}

impl Scenario {
    /// The one with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|scenario| scenario.name == name)
    }

    /// Its variants.
    pub fn all_variants(&self) -> impl Iterator<Item = u64> {
        let (from, to, every) = self.variants;
        (from..=to).step_by(every.max(1) as usize)
    }

    /// Runs it once on a new board that stands.
    ///
    /// # Errors
    /// Where the ELF does not fit, or misuses the board.
    pub fn run(&self, elf: &[u8], case: Case, corner: Corner) -> Result<Outcome, Problem> {
        let Case { variant, phase } = case;
        self.run_steps(elf, &(self.steps)(variant), phase, corner)
    }

    /// Runs it with other steps than its own.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_steps(
        &self,
        elf: &[u8],
        steps: &[Step],
        phase: u64,
        corner: Corner,
    ) -> Result<Outcome, Problem> {
        let mut options = BoardOptions::default();
        options.set_corner(corner);
        let filled = self.fill(elf)?;
        let at_us = match self.at_power_up {
            true => 0,
            // In steps that hit each of four ticks, and another part of it each time.
            false => AT_MS * 1000 + phase * 1_283,
        };
        (self.board)(&mut options, at_us as u32);
        let (motion, at_s) = (self.motion, at_us as f64 / 1.0e6);
        let mut board = Board::with_motion(elf, options, move |time: f64| motion(time - at_s))
            .map_err(|error| Problem::Elf(error.to_string()))?;
        if let Some(filled) = &filled {
            board.set_settings(&filled.bytes);
        }
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
                Step::Wait(us) => {
                    let until = board.now() + from_us(u64::from(us));
                    watch.run_until(&mut board, until)?;
                }
                Step::CutInErase(part) => {
                    let operations = filled.as_ref().map_or(0, |filled| filled.operations);
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
        let latest = end.unwrap_or(at) + self.deadline_ms() * MILLISECOND;
        let mut healthy_since = None;
        while board.now() < latest {
            let until = board.now() + 10 * MILLISECOND;
            watch.run_until(&mut board, until)?;
            let outcome = Outcome::of(self, &watch, &board, at, end);
            if outcome.is_complete(self) {
                let since = *healthy_since.get_or_insert(board.now());
                if board.now() - since >= AFTERWARDS_MS * MILLISECOND {
                    break;
                }
            } else {
                healthy_since = None;
            }
        }
        let mut outcome = Outcome::of(self, &watch, &board, at, end);
        if let Some((address, values)) = self.kept {
            Step::Ask(address).act(&mut board);
            let until = board.now() + 20 * MILLISECOND;
            watch.run_until(&mut board, until)?;
            outcome.take_setting(watch.answered(address), values);
        }
        outcome.violations = judge::violations(self, &outcome);
        Ok(outcome)
    }

    /// The pages that it begins with.
    fn fill(&self, elf: &[u8]) -> Result<Option<pages::Filled>, Problem> {
        match self.pages {
            Pages::Blank => Ok(None),
            Pages::BeforeAnErase => pages::before_an_erase(elf, list::OLD_SCALE).map(Some),
        }
    }

    /// Operations of flash in the store that its pages are filled for; 0 where they are blank.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn erasing_operations(&self, elf: &[u8]) -> Result<u64, Problem> {
        Ok(self.fill(elf)?.map_or(0, |filled| filled.operations))
    }

    /// Fills the pages with the settings of a board that has not run yet, where it begins with
    /// some.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn prepare(&self, elf: &[u8], board: &mut Board) -> Result<(), Problem> {
        if let Some(filled) = self.fill(elf)? {
            board.set_settings(&filled.bytes);
        }
        Ok(())
    }

    /// Whether there are no valid data any more.
    fn stays(&self) -> bool {
        self.invalid == Invalid::UntilCleared && self.lasts_ms.is_none()
    }

    /// How long to wait for all to be well, ms.
    fn deadline_ms(&self) -> u64 {
        let usual = if self.stays() { 1000 } else { 4000 };
        self.deadline_ms.unwrap_or(usual)
    }
}
