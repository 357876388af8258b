//! History of the recent ticks. It decides whether a sample is trusted, and when bad ticks cause a fault.

use core::ops::RangeInclusive;

use estimator_core::Timestamp;
use lsm6dsox::{FrozenDetector, RawSample};

use super::{SETTLED_TICKS, Tick};

/// Permitted number of data-ready edges from one tick to the next, if they are counted. The mean is 6.67. The range
/// allows for one edge and for 10 % of the sensor's clock.
const EDGES: RangeInclusive<u16> = 5..=8;

/// Consecutive ticks with the right number of edges after which samples are read at the edge again.
const EDGES_ARE_BACK: u16 = 1000;

/// Number of lost edges, each within [`LOST_WITHIN`] ticks of the previous one, that show a defective line. A stall of
/// the core can lose one or two.
const LOST: u8 = 3;
const LOST_WITHIN: usize = 50;

/// Consecutive ticks with a wrong number of edges that show a wrong rate of the sensor. If edges are lost at random,
/// whatever their share, one tick in ten has the right number, or no edge. So 200 in a row come once in weeks.
const WRONG_RATE: u16 = 200;

/// Repeats of a sample, with all six codes, before the sensor counts as frozen.
///
/// Computed from the noise of the preset: all six codes of a sample at rest repeat by chance once in 137 000 samples,
/// and three times in a row once in 80 000 years. With half of that noise three in a row come three times a year, or
/// once a day if the mean of each axis lies in the middle of a code. On such a part, two repeats in a row that end by
/// themselves come first, and raise the limit. Four repeats would take up to 5.0 ms.
pub const FROZEN_REPEATS: u16 = 3;

/// Number of repeats from which a sample is not trusted.
const UNTRUSTED_REPEATS: u16 = 2;

/// Consecutive ticks at the end of the range that are too many for an impact.
pub const SATURATED_TICKS: u16 = 50;

/// Increment of the count for a bad tick. A good tick subtracts 1.
const BAD_TICK: u16 = 20;

/// Count that causes a fault: three bad ticks in five, or four in 26.
const TOO_BAD: u16 = 3 * BAD_TICK - 2;

/// Event at which samples are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadAt {
    /// The data-ready edge after the tick.
    #[default]
    Edge,
    /// The end of the wait for the edge, because the line is dead or loses edges although the sensor measures.
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
    /// Whether no edge came in the previous tick although there was a new sample.
    edge_missed: bool,
    /// Edges lost, each soon after the previous one, and [`turn`](Self::turn) of the last one.
    lost: u8,
    lost_turn: usize,
    /// Event at which samples are read. A start of the sensor keeps it.
    pub(super) read_at: ReadAt,
    /// Consecutive ticks with the right number of edges while samples are read by the timer.
    with_edges: u16,
    /// Consecutive ticks with a wrong number of edges. A start of the sensor keeps it.
    wrong_rate: u16,
    /// Count of ticks. It selects the register that is read back.
    pub(super) turn: usize,
}

/// Reason why the sample of a tick is not trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleIssue {
    /// No edge arrived, and no new reading was found.
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
    AxisUnchanged,
}

impl Watch {
    /// Resets everything except the turn of the read-back, the event at which samples are read, the ticks at a wrong
    /// rate, and the noise that the part has shown.
    pub(super) fn restart(&mut self) {
        *self = Self {
            turn: self.turn,
            stale_turn: self.turn,
            read_at: self.read_at,
            wrong_rate: self.wrong_rate,
            frozen: self.frozen.restarted(),
            ..Self::default()
        };
    }

    /// Adds a sample to the history. Returns its issue, if it has one.
    pub(super) fn issue(&mut self, tick: &Tick, raw: &RawSample) -> Option<SampleIssue> {
        let (is_fresh, saturated) = (raw.is_fresh(), raw.is_saturated());
        self.saturated_ticks =
            if is_fresh && saturated { self.saturated_ticks.saturating_add(1) } else { 0 };
        // At the end of the range a working sensor repeats as well.
        if !saturated {
            self.frozen.update(raw);
        }
        // Without a count, the number is assumed to be right.
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

    /// Judges the time and the number of the edges.
    fn judge_edges(&mut self, tick: &Tick, number: u16, is_fresh: bool) -> Option<SampleIssue> {
        // A late edge also shows that the sensor runs.
        self.without_edge = if tick.edge.is_some() || tick.edges.is_some_and(|edges| edges > 0) {
            0
        } else {
            self.without_edge.saturating_add(1)
        };
        if tick.is_without_line {
            return None;
        }
        let is_right = EDGES.contains(&number);
        self.wrong_rate =
            if number > 0 && !is_right { self.wrong_rate.saturating_add(1) } else { 0 };
        // A missing edge was lost if edges at the right rate follow. On a dead line none follows, and a slow sensor
        // sends too few.
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

    /// Returns whether lost edges can explain three bad ticks that continue after a restart of the sensor. They can if
    /// each of these ticks had a new sample.
    pub(super) const fn has_lost_edges(&self) -> bool {
        self.turn.wrapping_sub(self.stale_turn) >= 3 && self.good_ticks < SETTLED_TICKS
    }

    /// Returns the axes that repeat, as bits: bit *i* is axis *i* in the order ax ay az wx wy wz.
    pub(super) fn frozen_axes(&self) -> u32 {
        let axes = if self.frozen.has_repeated(FROZEN_REPEATS) {
            FrozenDetector::EVERY_AXIS
        } else {
            self.frozen.frozen()
        };
        u32::from(axes)
    }

    /// Counts a tick, which is bad if it has an issue. Returns the issue if the count then causes a fault.
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
            SampleIssue::AxisUnchanged => return None,
            _ => {}
        }
        self.badness = self.badness.saturating_add(BAD_TICK);
        (self.badness >= TOO_BAD).then_some(issue)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lsm6dsox::Config;
    use std::vec::Vec;

    const FRESH: u8 = 0b11;

    /// A sample with this status and these codes, in the order wx wy wz ax ay az.
    fn sample(status: u8, codes: [i16; 6]) -> RawSample {
        let mut bytes = [0; 16];
        bytes[0] = status;
        for (bytes, code) in bytes[4..].chunks_mut(2).zip(codes) {
            bytes.copy_from_slice(&code.to_le_bytes());
        }
        RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status")
    }

    /// Samples in which no axis repeats.
    fn moving(k: i16) -> RawSample {
        sample(FRESH, [k, k + 1, k + 2, k + 3, k + 4, k + 5])
    }

    fn tick(edge: bool, edges: Option<u16>) -> Tick {
        Tick { edge: edge.then(|| Timestamp::from_micros(1)), edges, ..Tick::default() }
    }

    fn ordinary() -> Tick {
        tick(true, Some(7))
    }

    /// Counts ticks, bad where `bad` is 1; returns whether only the last one causes a fault.
    fn last_is_a_fault(bad: &[u8]) -> bool {
        let mut watch = Watch::default();
        let faults = bad.iter().map(|bad| {
            let issue = (*bad == 1).then_some(SampleIssue::Stale);
            watch.count(issue, Timestamp::from_micros(1)).is_some()
        });
        let faults: Vec<bool> = faults.collect();
        let (last, others) = faults.split_last().expect("ticks");
        assert!(!others.contains(&true), "{faults:?}");
        *last
    }

    #[test]
    fn edges_are_counted_only_by_hardware_and_on_ticks_in_a_row() {
        for (edges, missed, issue) in [
            (Some(4), 0, Some(SampleIssue::Unannounced)),
            (Some(5), 0, None),
            (Some(8), 0, None),
            (Some(9), 0, Some(SampleIssue::Rate)),
            (Some(9), 1, None),
            (None, 0, None),
        ] {
            let mut watch = Watch::default();
            let tick = Tick { missed, ..tick(true, edges) };
            assert_eq!(watch.issue(&tick, &moving(0)), issue, "{edges:?}, {missed}");
        }
    }

    #[test]
    fn board_without_a_line_misses_no_edge() {
        let mut watch = Watch::default();
        let tick = Tick { is_without_line: true, ..Tick::default() };
        for k in 0..100 {
            assert_eq!(watch.issue(&tick, &moving(k)), None);
        }
        assert_eq!(watch.read_at, ReadAt::Edge);
        assert_eq!(watch.issue(&tick, &sample(0, [0; 6])), Some(SampleIssue::Stale));
    }

    #[test]
    fn issues_are_ranked_missing_edge_then_stale_then_repeat() {
        let stale = sample(0, [0; 6]);
        let mut watch = Watch::default();
        for _ in 0..4 {
            watch.issue(&ordinary(), &moving(0));
        }
        let issue = watch.issue(&tick(false, None), &stale);
        assert_eq!(issue, Some(SampleIssue::Edge));
        assert_eq!(watch.issue(&ordinary(), &stale), Some(SampleIssue::Stale));
    }

    #[test]
    fn a_late_edge_ends_the_ticks_without_one() {
        let mut watch = Watch::default();
        let counts = [None, Some(0), Some(0), Some(1), None].map(|edges| {
            watch.issue(&tick(false, edges), &moving(0));
            watch.without_edge
        });
        assert_eq!(counts, [1, 2, 3, 0, 1]);
        watch.issue(&ordinary(), &moving(0));
        assert_eq!(watch.without_edge, 0);
    }

    #[test]
    fn the_second_repeat_is_untrusted_and_the_third_is_a_fault() {
        let mut watch = Watch::default();
        let now = Timestamp::from_micros(1);
        let issues = [(); 4].map(|()| {
            let issue = watch.issue(&ordinary(), &moving(0));
            (issue, watch.count(issue, now))
        });
        let repeat = Some(SampleIssue::Repeat);
        assert_eq!(issues, [(None, None), (None, None), (repeat, None), (repeat, repeat)]);
        assert_eq!(watch.frozen_axes(), 0b11_1111);
        watch.issue(&ordinary(), &moving(1));
        assert_eq!(watch.frozen_axes(), 0);
    }

    #[test]
    fn an_axis_that_has_not_changed_yet_is_not_a_fault() {
        let mut watch = Watch::default();
        for _ in 0..100 {
            let fault = watch.count(Some(SampleIssue::AxisUnchanged), Timestamp::from_micros(1));
            assert_eq!(fault, None);
        }
        assert_eq!((watch.bad_ticks, watch.good_ticks), (100, 0));
    }

    #[test]
    fn consecutive_saturated_samples_are_counted_and_may_repeat() {
        let mut watch = Watch::default();
        let end = [0, 0, 0, i16::MAX, 0, 0];
        for count in 1..=60 {
            assert_eq!(watch.issue(&ordinary(), &sample(FRESH, end)), None);
            assert_eq!(watch.saturated_ticks, count);
        }
        watch.issue(&ordinary(), &sample(0, end));
        assert_eq!(watch.saturated_ticks, 0, "a stale one");
        watch.issue(&ordinary(), &sample(FRESH, end));
        watch.issue(&ordinary(), &moving(0));
        assert_eq!(watch.saturated_ticks, 0, "one within the range");
    }

    #[test]
    fn three_bad_ticks_in_five_or_four_in_twenty_six_are_a_fault() {
        assert!(!last_is_a_fault(&[1, 1]));
        assert!(last_is_a_fault(&[1, 1, 1]));
        assert!(last_is_a_fault(&[1, 0, 1, 0, 1]));
        assert!(!last_is_a_fault(&[1, 0, 1, 0, 0, 1]));
        let four = |good: usize| {
            let mut ticks = std::vec![0; good];
            ticks.splice(0..0, [1, 1]);
            ticks.splice(5..5, [1]);
            ticks.push(1);
            last_is_a_fault(&ticks)
        };
        assert!(four(22));
        assert!(!four(23));
    }

    #[test]
    fn a_good_tick_ends_the_bad_ones_and_is_remembered() {
        let mut watch = Watch::default();
        let at = Timestamp::from_micros;
        watch.count(Some(SampleIssue::Bus), at(1));
        watch.count(Some(SampleIssue::Status(0x80)), at(2));
        assert_eq!((watch.bad_ticks, watch.last_good), (2, None));
        watch.count(None, at(3));
        watch.count(None, at(4));
        assert_eq!((watch.bad_ticks, watch.good_ticks), (0, 2));
        assert_eq!(watch.last_good, Some(at(4)));
    }

    #[test]
    fn a_restart_resets_all_but_the_turn_of_the_read_back() {
        let mut watch = Watch { turn: 7, ..Watch::default() };
        let now = Timestamp::from_micros(1);
        watch.issue(&tick(false, None), &moving(0));
        for _ in 0..2 {
            assert_eq!(watch.count(Some(SampleIssue::Edge), now), None);
        }
        watch.restart();
        assert_eq!((watch.turn, watch.without_edge, watch.bad_ticks), (7, 0, 0));
        // The third bad tick would be a fault.
        assert_eq!(watch.count(Some(SampleIssue::Edge), now), None);
    }

    #[test]
    fn dead_line_differs_from_a_silent_sensor() {
        let mut watch = Watch::default();
        let dead = tick(false, Some(0));
        assert_eq!(watch.issue(&dead, &moving(1)), Some(SampleIssue::Unannounced));
        assert_eq!(watch.issue(&dead, &sample(0, [0; 6])), Some(SampleIssue::Edge));
    }

    #[test]
    fn third_lost_edge_soon_has_samples_read_by_the_timer() {
        for (between, read_at) in [(40, ReadAt::Timer), (60, ReadAt::Edge)] {
            let mut watch = Watch::default();
            for lost in 0..3 {
                for k in 0..between {
                    assert_eq!(watch.read_at, ReadAt::Edge, "{lost}, {k}");
                    let tick = if k == 0 { tick(false, Some(6)) } else { ordinary() };
                    watch.issue(&tick, &moving(k));
                    watch.turn += 1;
                    if lost == 2 && k == 1 {
                        break;
                    }
                }
            }
            assert_eq!(watch.read_at, read_at);
        }
    }

    #[test]
    fn ticks_that_show_a_lost_edge() {
        let after = |first: Tick, second: Tick| {
            let mut watch = Watch::default();
            // Two lost edges.
            for k in 0..4 {
                let tick = if k % 2 == 0 { tick(false, Some(6)) } else { ordinary() };
                watch.issue(&tick, &moving(k));
                watch.turn += 1;
            }
            watch.issue(&ordinary(), &moving(0));
            let issue = watch.issue(&first, &moving(1));
            assert_eq!(issue, Some(SampleIssue::Unannounced));
            (watch.issue(&second, &moving(2)), watch.read_at)
        };
        let lost = tick(false, Some(6));
        assert_eq!(after(lost, ordinary()), (None, ReadAt::Timer));
        assert_eq!(after(lost, lost), (None, ReadAt::Timer));
        let unannounced = Some(SampleIssue::Unannounced);
        // A dead line sends no edge, and a sensor that is too slow sends four.
        for edges in [0, 4] {
            let second = tick(false, Some(edges));
            assert_eq!(after(lost, second), (unannounced, ReadAt::Edge));
        }
        let uncounted = tick(false, None);
        assert_eq!(after(uncounted, uncounted), (unannounced, ReadAt::Edge));
        assert_eq!(after(uncounted, tick(true, None)), (None, ReadAt::Timer));
    }

    #[test]
    fn a_wrong_rate_is_an_issue_of_the_timer_after_a_while() {
        for wrong in [tick(true, Some(3)), tick(true, Some(60))] {
            let mut watch = Watch { read_at: ReadAt::Timer, ..Watch::default() };
            let first_issue = |watch: &mut Watch| {
                let issue = (0..1000).find(|k| watch.issue(&wrong, &moving(*k)).is_some());
                issue.expect("an issue")
            };
            assert_eq!(first_issue(&mut watch), 199);
            // A restart of the sensor keeps the count. A tick without edges, or with the right number of them, ends it.
            watch.restart();
            assert_eq!(first_issue(&mut watch), 0);
            for other in [tick(false, Some(0)), ordinary()] {
                assert_eq!(watch.issue(&other, &moving(1)), None);
                assert_eq!(first_issue(&mut watch), 199);
            }
            assert_eq!(watch.read_at, ReadAt::Timer);
        }
    }

    #[test]
    fn edges_of_a_second_end_the_reading_by_timer() {
        let mut watch = Watch { read_at: ReadAt::Timer, ..Watch::default() };
        watch.restart();
        assert_eq!(watch.issue(&tick(false, Some(0)), &moving(0)), None);
        assert_eq!(
            watch.issue(&tick(false, Some(0)), &sample(0, [0; 6])),
            Some(SampleIssue::Stale)
        );
        let ticks = |watch: &mut Watch, ticks: i16, tick: Tick| {
            for k in 0..ticks {
                assert_eq!(watch.issue(&tick, &moving(k)), None);
            }
        };
        ticks(&mut watch, 999, ordinary());
        // A tick without an edge, or with too many, resets the count.
        ticks(&mut watch, 1, tick(true, Some(60)));
        ticks(&mut watch, 999, ordinary());
        assert_eq!(watch.read_at, ReadAt::Timer);
        ticks(&mut watch, 1, ordinary());
        assert_eq!(watch.read_at, ReadAt::Edge);
    }
}
