//! History of the recent ticks: whether a sample is trusted, and when bad ticks cause a fault.

use core::ops::RangeInclusive;

use estimator_core::Timestamp;
use lsm6dsox::{FrozenDetector, RawSample};

use super::Tick;

/// Data-ready edges from one tick to the next, if they are counted: 6.67, give or take one and
/// 10 % of the sensor's clock.
const EDGES: RangeInclusive<u16> = 5..=8;

/// Consecutive ticks with the right number of edges after which samples are read at the edge again.
const EDGES_ARE_BACK: u16 = 1000;

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
    /// The end of the wait for it: the line is dead, and the sensor is not.
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
    /// Event at which samples are read; kept at a start of the sensor.
    pub(super) read_at: ReadAt,
    /// Consecutive ticks with the right number of edges while samples are read by the timer.
    with_edges: u16,
    /// Count of ticks: it selects the register that is read back.
    pub(super) turn: usize,
}

/// Reason why the sample of a tick is not trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleIssue {
    /// No edge came, and nothing new was read.
    Edge,
    /// No edge came, though there is a new sample.
    Unannounced,
    /// The number of edges is wrong.
    Rate,
    /// Nothing new was read.
    Stale,
    /// The part cannot send this status byte.
    Status(u8),
    /// The transfer failed.
    Bus,
    /// The sample has repeated at least twice, or some of its axes have repeated for long.
    Repeat,
    /// An axis has not changed yet since a start that followed repeats.
    Unproven,
}

impl Watch {
    /// Resets everything except the turn of the read-back and the event at which samples are read.
    pub(super) fn restart(&mut self) {
        *self = Self {
            turn: self.turn,
            read_at: self.read_at,
            ..Self::default()
        };
    }

    /// Adds a sample to the history; returns the issue with it, if there is one.
    pub(super) fn issue(&mut self, tick: &Tick, raw: &RawSample) -> Option<SampleIssue> {
        // A late edge also shows that the sensor runs.
        self.without_edge = if tick.edge.is_some() || tick.edges.is_some_and(|edges| edges > 0) {
            0
        } else {
            self.without_edge.saturating_add(1)
        };
        let saturated = raw.is_saturated();
        self.saturated_ticks = if raw.is_fresh() && saturated {
            self.saturated_ticks.saturating_add(1)
        } else {
            0
        };
        // At the end of the range a working sensor repeats as well.
        if !saturated {
            self.frozen.update(raw);
        }
        let wrong_rate =
            tick.missed == 0 && tick.edges.is_some_and(|edges| !EDGES.contains(&edges));
        if self.read_at == ReadAt::Timer {
            self.with_edges = match tick.edge {
                Some(_) if !wrong_rate => self.with_edges + 1,
                _ => 0,
            };
            if self.with_edges >= EDGES_ARE_BACK {
                self.read_at = ReadAt::Edge;
            }
        } else if tick.edge.is_none() {
            return Some(match raw.is_fresh() {
                true => SampleIssue::Unannounced,
                false => SampleIssue::Edge,
            });
        }
        if !raw.is_fresh() {
            Some(SampleIssue::Stale)
        } else if self.frozen.repeats() >= UNTRUSTED_REPEATS || self.frozen.frozen() != 0 {
            Some(SampleIssue::Repeat)
        } else if wrong_rate && self.read_at == ReadAt::Edge {
            Some(SampleIssue::Rate)
        } else {
            None
        }
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
