//! Report of received, missing and invalid frames.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::row::ContactRow;
use crate::decode::can_log::Form;

samples::named! {
    /// Line on which the foot has sent.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Medium {
        /// A log of CAN frames.
        #[default]
        Can = "CAN log",
        /// A recording of the serial line.
        Uart = "serial line",
    }
}

/// An emergency message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EmergencyReport {
    /// Time of the foot's last contact frame before the emergency, s; `None` without such a frame.
    pub t: Option<f64>,
    /// The interface that received it.
    pub interface: String,
    /// The foot's node id.
    pub node: u8,
    /// The emergency code; 0 if a fault was cleared.
    pub code: u16,
    /// Name of the fault.
    pub fault: String,
    /// Detail of the fault; its meaning depends on the fault (`docs/reference/faults.md`).
    pub detail: u32,
}

/// State of the board in its newest health message, which it sends only on the serial line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoardReport {
    /// Stage of its operation.
    pub stage: &'static str,
    /// Active faults.
    pub faults: Vec<&'static str>,
    /// Temperature of the sensor, °C; `None` if it was unknown.
    pub temperature: Option<f32>,
    /// Counters of the board.
    pub counters: BTreeMap<&'static str, u32>,
}

/// Received, missing and unreadable data of a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Line on which the foot has sent.
    pub format: Medium,
    /// Form of the log; CAN only.
    pub log: Option<Form>,
    /// Number of rows, which are contact frames or messages.
    pub rows: usize,
    /// Time of the first row, s.
    pub first_s: Option<f64>,
    /// Time of the last row, s.
    pub last_s: Option<f64>,
    /// Longest time between two consecutive rows of a foot, s.
    pub longest_step_s: Option<f64>,
    /// Number of frames received of each kind.
    pub frames: BTreeMap<&'static str, u64>,
    /// Number of rows by the clock of their `t_common`; CAN only.
    pub clocks: BTreeMap<&'static str, u64>,
    /// Number of gaps in the sequence numbers.
    pub gaps: u64,
    /// Number of missing sequence numbers, including the numbers of damaged frames. On CAN they are modulo 256, and the
    /// foot's clock gives the length of longer gaps.
    pub missing: u64,
    /// Number of restarts of the feet within the file; each resets the foot's clock and its sequence numbers.
    pub restarts: u64,
    /// Number of contacts that the file has twice; they have one row.
    pub duplicates: u64,
    /// Number of unreadable or contradictory data, by their kind. A contact that is out of order is counted here, and as
    /// missing before the later one that it follows.
    pub problems: BTreeMap<String, u64>,
    /// Emergency messages, in the order of the file.
    pub emergencies: Vec<EmergencyReport>,
    /// Newest state of the board; serial line only.
    pub board: Option<BoardReport>,
}

impl Report {
    pub(super) fn new(format: Medium) -> Self {
        Self { format, ..Self::default() }
    }

    pub(super) fn count_frame(&mut self, kind: &'static str) {
        *self.frames.entry(kind).or_default() += 1;
    }

    pub(super) fn count_problem(&mut self, problem: impl Into<String>) {
        self.count_problems(problem, 1);
    }

    pub(super) fn count_problems(&mut self, problem: impl Into<String>, count: u64) {
        let counted = self.problems.entry(problem.into()).or_default();
        *counted = counted.saturating_add(count);
    }

    /// Uncounts a missing frame that arrived late.
    pub(super) fn count_overtaken(&mut self) {
        self.missing = self.missing.saturating_sub(1);
        let least = u64::from(self.missing > 0);
        self.gaps = self.gaps.saturating_sub(1).max(least);
    }

    /// Adds to the number missing in a gap that is already counted; negative if fewer are missing.
    pub(super) fn correct_missing(&mut self, more: i64) {
        self.missing = self.missing.saturating_add_signed(more);
        let least = u64::from(self.missing > 0);
        self.gaps = self.gaps.max(least);
    }

    /// Counts the numbers missing between two consecutive frames.
    pub(super) fn count_missing(&mut self, missing: u64) {
        self.missing += missing;
        self.gaps += u64::from(missing > 0);
    }

    /// Adds the provisional counts of one contact: gaps, missing numbers, duplicates, problems and the longest step. All
    /// other fields are ignored.
    pub(super) fn add_contact(&mut self, counted: Self) {
        self.gaps += counted.gaps;
        self.missing += counted.missing;
        self.duplicates += counted.duplicates;
        for (problem, count) in counted.problems {
            self.count_problems(problem, count);
        }
        self.note_step(counted.longest_step_s);
    }

    /// Updates the longest step with the times of two consecutive rows of a foot, µs.
    pub(super) fn count_step(&mut self, from: u64, to: u64) {
        self.note_step(to.checked_sub(from).map(seconds));
    }

    fn note_step(&mut self, step: Option<f64>) {
        let steps = self.longest_step_s.into_iter().chain(step);
        self.longest_step_s = steps.reduce(f64::max);
    }

    /// Counts a complete row.
    pub(super) fn count_row(&mut self, row: &ContactRow) {
        let t = seconds(row.timestamp.as_micros());
        self.rows += 1;
        self.first_s = Some(self.first_s.map_or(t, |first| first.min(t)));
        self.last_s = Some(self.last_s.map_or(t, |last| last.max(t)));
        if let Some((_, clock)) = row.common {
            *self.clocks.entry(clock.name()).or_default() += 1;
        }
    }
}

fn seconds(micros: u64) -> f64 {
    micros as f64 / 1.0e6
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} rows", self.format.name(), self.rows)?;
        if let (Some(first), Some(last)) = (self.first_s, self.last_s) {
            write!(f, ", {first:.3} s to {last:.3} s")?;
        }
        if let Some(longest) = self.longest_step_s {
            write!(f, ", at most {:.2} ms apart", longest * 1e3)?;
        }
        write!(f, "\nframes   {}", list(&self.frames))?;
        if !self.clocks.is_empty() {
            write!(f, "\nclock    {}", list(&self.clocks))?;
        }
        write!(f, "\nmissing  {} in {} gaps", self.missing, self.gaps)?;
        if self.duplicates > 0 {
            write!(f, ", {} duplicates", self.duplicates)?;
        }
        if self.restarts > 0 {
            write!(f, "\nrestarts {}", self.restarts)?;
        }
        write!(f, "\nproblems {}", list(&self.problems))?;
        for emergency in &self.emergencies {
            write!(f, "\nfault    ")?;
            if let Some(t) = emergency.t {
                write!(f, "{t:.3} s, ")?;
            }
            let (node, fault) = (emergency.node, &emergency.fault);
            write!(f, "{}, node {node}: {fault}", emergency.interface)?;
            match (emergency.code, emergency.detail) {
                (0, _) => write!(f, " has gone")?,
                (code, detail) => write!(f, " (0x{code:04X}), detail {detail}")?,
            }
        }
        if let Some(board) = &self.board {
            let faults = match board.faults[..] {
                [] => "no fault".to_owned(),
                _ => board.faults.join(", "),
            };
            write!(f, "\nboard    {}, {faults}", board.stage)?;
            if let Some(temperature) = board.temperature {
                write!(f, ", {temperature:.1} °C")?;
            }
        }
        Ok(())
    }
}

fn list<K: fmt::Display>(counts: &BTreeMap<K, u64>) -> String {
    let counts = counts.iter();
    let counts = counts.map(|(name, count)| format!("{name} {count}"));
    match &counts.collect::<Vec<_>>()[..] {
        [] => "none".to_owned(),
        counts => counts.join(", "),
    }
}
