//! History of the recent ticks: whether a sample is trusted, and when bad ticks cause a fault.

use core::ops::RangeInclusive;

use estimator_core::Timestamp;
use lsm6dsox::{FrozenDetector, RawSample};

use super::{SETTLED_TICKS, Tick};

/// Data-ready edges from one tick to the next, if they are counted: 6.67, give or take one and
/// 10 % of the sensor's clock.
const EDGES: RangeInclusive<u16> = 5..=8;

/// Consecutive ticks with the right number of edges after which samples are read at the edge again.
const EDGES_ARE_BACK: u16 = 1000;

/// Lost edges, each within [`LOST_WITHIN`] ticks of the one before, that show that the line loses them: one or two can
/// be a stall of the core.
const LOST: u8 = 3;
const LOST_WITHIN: usize = 50;

/// Consecutive ticks with edges of a wrong number that are the rate of the sensor: of edges that are lost at random,
/// however many, one tick in ten has the right number, or none, so that 200 in a row come once in weeks.
const WRONG_RATE: u16 = 200;

/// Repeats of a sample, with all six codes, before the sensor counts as frozen. With the
/// noise of the preset all six codes repeat by chance once in 137 000 samples at rest, three times in a
/// row once in 80 000 years; with half of that noise it would be three times a year, and once a day
/// where the mean of each axis lies in the middle of a code. Four repeats would take up to 5.0 ms.
pub const FROZEN_REPEATS: u16 = 3;

/// Number of repeats from which a sample is not trusted.
const UNTRUSTED_REPEATS: u16 = 2;

/// Consecutive ticks at the end of the range that are too many for an impact.
pub const SATURATED_TICKS: u16 = 50;

/// Increment of the count for a bad tick; a good one subtracts 1.
const BAD_TICK: u16 = 20;

/// Count that causes a fault: three bad ticks in five, or four in 26.
const TOO_BAD: u16 = 3 * BAD_TICK - 2;

/// Event at which samples are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadAt {
    /// The data-ready edge after the tick.
    #[default]
    Edge,
    /// The end of the wait for it: the line is dead or loses edges, and the sensor measures.
    Timer,
}

/// History of the recent ticks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    pub(super) frozen: FrozenDetector,
    /// Count of bad ticks: see [`BAD_TICK`].
    badness: u16,
    /// Consecutive bad ticks.
    pub(super) bad_ticks: u32,
    /// Good ticks since the start of the sensor.
    pub(super) good_ticks: u32,
    /// Consecutive samples at the end of the range.
    pub(super) saturated_ticks: u16,
    pub(super) last_good: Option<Timestamp>,
    /// Ticks since the last edge.
    pub(super) without_edge: u16,
    /// [`turn`](Self::turn) of the last sample that was not new.
    stale_turn: usize,
    /// Whether no edge came in the previous tick, though there was a new sample.
    edge_missed: bool,
    /// Edges lost, each soon after the one before, and [`turn`](Self::turn) of the last.
    lost: u8,
    lost_turn: usize,
    /// Event at which samples are read; kept at a start of the sensor.
    pub(super) read_at: ReadAt,
    /// Consecutive ticks with the right number of edges while samples are read by the timer.
    with_edges: u16,
    /// Consecutive ticks with edges of a wrong number; kept at a start of the sensor.
    wrong_rate: u16,
    /// Count of ticks: it selects the register that is read back.
    pub(super) turn: usize,
}

/// Reason why the sample of a tick is not trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleIssue {
    /// No edge came, and nothing new was read.
    Edge,
    /// No edge came, or too few, though there is a new sample.
    Unannounced,
    /// Edges are too many, or have come at a wrong rate for long.
    Rate,
    /// Nothing new was read.
    Stale,
    /// The part cannot send this status byte.
    Status(u8),
    /// The transfer failed.
    Bus,
    /// The sample has repeated at least twice, or some of its axes have repeated for long.
    Repeat,
    /// An axis has not changed yet since the start.
    Unproven,
}

impl Watch {
    /// Resets everything except the turn of the read-back, the event at which samples are read, and the ticks at a wrong
    /// rate.
    pub(super) fn restart(&mut self) {
        *self = Self {
            turn: self.turn,
            stale_turn: self.turn,
            read_at: self.read_at,
            wrong_rate: self.wrong_rate,
            ..Self::default()
        };
    }

    /// Adds a sample to the history; returns the issue with it, if there is one.
    pub(super) fn issue(&mut self, tick: &Tick, raw: &RawSample) -> Option<SampleIssue> {
        let (is_fresh, saturated) = (raw.is_fresh(), raw.is_saturated());
        self.saturated_ticks =
            if is_fresh && saturated { self.saturated_ticks.saturating_add(1) } else { 0 };
        // At the end of the range a working sensor repeats as well.
        if !saturated {
            self.frozen.update(raw);
        }
        // As it should be where it is not counted.
        let number = match tick.edges {
            Some(edges) if tick.missed == 0 => edges,
            _ => *EDGES.start(),
        };
        let edges = self.judge_edges(tick, number, is_fresh);
        if !is_fresh {
            self.stale_turn = self.turn;
            return Some(match edges {
                Some(SampleIssue::Edge) => SampleIssue::Edge,
                _ => SampleIssue::Stale,
            });
        }
        if self.frozen.repeats() >= UNTRUSTED_REPEATS || self.frozen.frozen() != 0 {
            Some(SampleIssue::Repeat)
        } else {
            edges
        }
    }

    /// Judges time and number of the edges.
    fn judge_edges(&mut self, tick: &Tick, number: u16, is_fresh: bool) -> Option<SampleIssue> {
        // A late edge also shows that the sensor runs.
        self.without_edge = if tick.edge.is_some() || tick.edges.is_some_and(|edges| edges > 0) {
            0
        } else {
            self.without_edge.saturating_add(1)
        };
        let is_right = EDGES.contains(&number);
        self.wrong_rate = match number {
            1.. if !is_right => self.wrong_rate.saturating_add(1),
            _ => 0,
        };
        // Of a line that is dead none follows, of a sensor that is too slow too few.
        if self.edge_missed && is_right && self.without_edge == 0 {
            let is_soon = self.turn.wrapping_sub(self.lost_turn) <= LOST_WITHIN;
            self.lost = if is_soon { self.lost.saturating_add(1) } else { 1 };
            self.lost_turn = self.turn;
            if self.lost >= LOST {
                self.read_by_timer();
            }
        }
        self.edge_missed = tick.edge.is_none() && is_fresh;
        if self.read_at == ReadAt::Timer {
            self.with_edges = match tick.edge {
                Some(_) if is_right => self.with_edges + 1,
                _ => 0,
            };
            if self.with_edges >= EDGES_ARE_BACK {
                self.read_at = ReadAt::Edge;
            }
            return (self.wrong_rate >= WRONG_RATE).then_some(SampleIssue::Rate);
        }
        if tick.edge.is_some() && is_right {
            None
        } else if !is_fresh && tick.edge.is_none() {
            Some(SampleIssue::Edge)
        } else if tick.edge.is_none() || number < *EDGES.start() {
            Some(SampleIssue::Unannounced)
        } else {
            Some(SampleIssue::Rate)
        }
    }

    /// Reads samples by the timer from now on.
    pub(super) const fn read_by_timer(&mut self) {
        if let ReadAt::Edge = self.read_at {
            self.read_at = ReadAt::Timer;
            self.with_edges = 0;
        }
    }

    /// Returns whether lost edges can be the cause of three bad ticks that a restart has not ended: each had a new sample.
    pub(super) const fn has_lost_edges(&self) -> bool {
        self.turn.wrapping_sub(self.stale_turn) >= 3 && self.good_ticks < SETTLED_TICKS
    }

    /// Bit *i*: axis *i* repeats, in the order ax ay az wx wy wz.
    pub(super) fn frozen_axes(&self) -> u32 {
        let axes = if self.frozen.repeats() >= FROZEN_REPEATS {
            FrozenDetector::EVERY_AXIS
        } else {
            self.frozen.frozen()
        };
        u32::from(axes)
    }

    /// Adds a tick to the count of bad ones; returns its issue if that causes a fault.
    pub(super) fn count(
        &mut self,
        issue: Option<SampleIssue>,
        now: Timestamp,
    ) -> Option<SampleIssue> {
        let Some(issue) = issue else {
            self.badness = self.badness.saturating_sub(1);
            self.bad_ticks = 0;
            self.good_ticks = self.good_ticks.saturating_add(1);
            self.last_good = Some(now);
            return None;
        };
        self.bad_ticks = self.bad_ticks.saturating_add(1);
        match issue {
            // The detector has its own count.
            SampleIssue::Repeat => return (self.frozen_axes() != 0).then_some(issue),
            SampleIssue::Unproven => return None,
            _ => {}
        }
        self.badness = self.badness.saturating_add(BAD_TICK);
        (self.badness >= TOO_BAD).then_some(issue)
    }
}

#[cfg(test)]
mod tests;
