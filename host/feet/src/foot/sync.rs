//! Comparison of the clocks of several feet by their reports of the SYNCs on their bus.
//!
//! A SYNC reaches all feet at the same time, and each reports its reception time in its health frame, on its
//! own clock in steps of 10 µs. If two feet have reported the same SYNC, the difference is the offset of their
//! clocks; otherwise the time on the reference is interpolated between two reported SYNCs. A line fitted
//! through all differences yields offset and drift.

use std::collections::{BTreeMap, VecDeque};

use crate::decode::live::{FootKey, Heard, Said};
use thiserror::Error;
use wire::pdo::{ClockReading, TIME_STEP_US};

/// SYNCs kept for matching a report: one full cycle of the counter.
const REMEMBERED: usize = ClockReading::HIGHEST_SYNC as usize;

/// Maximum interval between two reports, in steps of the foot's clock: 1 s.
const LONGEST_GAP: i64 = 100_000;

/// Minimum number of differences for a fit with errors.
const LEAST: usize = 5;

/// Reports of one foot.
#[derive(Clone, Debug, Default)]
struct Reported {
    /// Time of the newest SYNC in steps of the foot's clock, unwrapped beyond 2³².
    newest: Option<i64>,
    /// Reception time by index of the SYNC, counted from the first that was heard.
    syncs: BTreeMap<u64, i64>,
}

/// Reports of the feet on one bus.
#[derive(Clone, Debug, Default)]
pub struct Clocks {
    feet: BTreeMap<FootKey, Reported>,
    /// Newest SYNCs on the bus: their numbers, and their indices since the first that was heard.
    heard: VecDeque<(u8, u64)>,
    has_sync_without_number: bool,
    /// Number of SYNCs whose number went back to one other than 1.
    leaps_back: u64,
    interruptions: u64,
}

/// Clock of a foot relative to that of another, the reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The foot.
    pub foot: FootKey,
    /// Offset of this clock from the reference at the middle of the observation, µs.
    pub offset_us: f64,
    /// Error of the offset, µs: twice its standard error, at least one step.
    pub offset_error_us: f64,
    /// Rate of this clock relative to the reference, ppm; positive if it is faster.
    pub drift_ppm: f64,
    /// Error of the drift, ppm: twice its standard error, at least one step over the observation.
    pub drift_error_ppm: f64,
    /// Number of SYNCs used.
    pub syncs: usize,
    /// Duration of the observation, s.
    pub span_s: f64,
}

/// Error of a comparison of clocks.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SyncError {
    /// Fewer than two feet have reported a SYNC.
    #[error("the clocks of two feet are compared; feet that reported a SYNC: {0}")]
    TooFew(usize),
    /// SYNCs have no numbers.
    #[error(
        "the SYNCs on this bus have no numbers: the master has to count them (its object 0x1019, synchronous counter overflow value, 240)"
    )]
    NoNumbers,
    /// The numbers of the SYNCs go back.
    #[error(
        "the numbers of the SYNCs on this bus go back in between: does more than one master send them?"
    )]
    SeveralMasters,
    /// There are no SYNCs.
    #[error("there are no SYNCs on this bus: start its master, or have them sent with --send")]
    NoSync,
    /// Too few SYNCs were reported.
    #[error("too few SYNCs were reported: {0} where {LEAST} are needed; listen for longer")]
    TooShort(usize),
}

impl Clocks {
    /// Adds a SYNC on the bus, with its number if it has one. A master counts to 240 or less, and wraps to 1.
    pub fn take_sync(&mut self, number: Option<u8>) {
        let Some(number) = number.filter(|number| *number > 0) else {
            self.has_sync_without_number = true;
            return;
        };
        let index = match self.heard.back() {
            None => 0,
            // A missed SYNC leaves a gap.
            Some((last, index)) if number > *last => index + u64::from(number - last),
            Some((_, index)) => {
                self.leaps_back += u64::from(number != 1);
                index + 1
            }
        };
        if self.heard.len() == REMEMBERED {
            self.heard.pop_front();
        }
        self.heard.push_back((number, index));
    }

    /// Adds a message of a foot.
    pub fn take(&mut self, heard: &Heard) {
        match &heard.said {
            Said::Health(health) => self.report(&heard.foot, health.clock),
            // The clock of the foot restarts.
            Said::BootUp(_) => self.forget(&heard.foot),
            _ => {}
        }
    }

    /// Number of restarts of feet, and of gaps longer than SYNCs can be counted; earlier reports of the foot are
    /// discarded.
    #[must_use]
    pub const fn interruptions(&self) -> u64 {
        self.interruptions
    }

    fn forget(&mut self, foot: &FootKey) {
        if self.feet.remove(foot).is_some() {
            self.interruptions += 1;
        }
    }

    fn report(&mut self, foot: &FootKey, clock: ClockReading) {
        let is_it = |(number, _): &&(u8, u64)| *number == clock.sync;
        let Some((_, index)) = self.heard.iter().rev().find(is_it).copied() else {
            return;
        };
        let time = i64::from(clock.time.0);
        let last = self.feet.get(foot).and_then(|reported| reported.newest);
        if last.is_some_and(|last| (time - last).rem_euclid(1 << 32) > LONGEST_GAP) {
            self.forget(foot);
        }
        let reported = self.feet.entry(foot.clone()).or_default();
        let unwrapped = |last: i64| last + (time - last).rem_euclid(1 << 32);
        let time = reported.newest.map_or(time, unwrapped);
        reported.newest = Some(time);
        reported.syncs.insert(index, time);
    }

    /// Compares the clock of each foot with that of the first, in the order of lines and ids.
    ///
    /// # Errors
    /// Fewer than two feet have reported, they have reported too few SYNCs, or the SYNCs cannot be used.
    pub fn compare(&self) -> Result<(FootKey, Vec<Comparison>), SyncError> {
        if self.leaps_back > 1 {
            return Err(SyncError::SeveralMasters);
        }
        let mut feet = self.feet.iter();
        let (Some((first, reference)), true) = (feet.next(), self.feet.len() > 1) else {
            return Err(match self.has_sync_without_number {
                _ if !self.heard.is_empty() => SyncError::TooFew(self.feet.len()),
                true => SyncError::NoNumbers,
                false => SyncError::NoSync,
            });
        };
        let compared = feet.map(|(foot, reported)| {
            let points = differences(reference, reported);
            if points.len() < LEAST {
                return Err(SyncError::TooShort(points.len()));
            }
            Ok(line(foot, &points))
        });
        Ok((first.clone(), compared.collect::<Result<_, _>>()?))
    }
}

/// Returns the time of each SYNC of `own` on the clock of `reference`, s, and the difference of both, µs.
fn differences(reference: &Reported, own: &Reported) -> Vec<(f64, f64)> {
    let step = TIME_STEP_US as f64;
    let points = own.syncs.iter().filter_map(|(number, time)| {
        let (before, before_time) = reference.syncs.range(..=number).next_back()?;
        let (after, after_time) = reference.syncs.range(number..).next()?;
        let share = match after - before {
            0 => 0.0,
            between => (number - before) as f64 / between as f64,
        };
        let on_reference = *before_time as f64 + share * (after_time - before_time) as f64;
        let difference = *time as f64 - on_reference;
        Some((on_reference * step * 1.0e-6, difference * step))
    });
    points.collect()
}

/// Fits a line through the differences by least squares, with errors from the residuals.
fn line(foot: &FootKey, points: &[(f64, f64)]) -> Comparison {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (mean_s, mean_us) = (mean(|point| point.0), mean(|point| point.1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        let parts = points.iter().map(|(s, us)| of(s - mean_s, us - mean_us));
        parts.sum::<f64>()
    };
    let squares = sum(&|s, _| s * s);
    let drift_ppm = sum(&|s, us| s * us) / squares;
    let left = sum(&|s, us| (us - drift_ppm * s).powi(2));
    let deviation = (left / (count - 2.0)).sqrt();
    let first = points.first().map_or(0.0, |point| point.0);
    let span_s = points.last().map_or(0.0, |point| point.0) - first;
    let step = TIME_STEP_US as f64;
    Comparison {
        foot: foot.clone(),
        offset_us: mean_us,
        offset_error_us: (2.0 * deviation / count.sqrt()).max(step),
        drift_ppm,
        drift_error_ppm: (2.0 * deviation / squares.sqrt()).max(step / span_s),
        syncs: points.len(),
        span_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;
    use wire::Faults;
    use wire::pdo::{Health, LongTime};

    /// A foot that reports the SYNCs whose number ends in `phase`.
    #[derive(Clone, Copy)]
    struct Foot {
        node: u8,
        /// Clock at the first SYNC, µs, and its rate error, ppm.
        begins_us: f64,
        ppm: f64,
        phase: u64,
    }

    impl Foot {
        const fn new(node: u8, begins_us: f64, ppm: f64, phase: u64) -> Self {
            Self {
                node,
                begins_us,
                ppm,
                phase,
            }
        }
    }

    /// Robot with SYNCs about every 10 ms, numbered up to `overflow`.
    struct Bench {
        clocks: Clocks,
        overflow: u64,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                clocks: Clocks::default(),
                overflow: 240,
            }
        }

        /// Runs ten seconds, in which each foot reports every tenth SYNC.
        fn run(&mut self, feet: &[Foot]) {
            for k in 0..1000_u64 {
                let counter = (k % self.overflow + 1) as u8;
                self.clocks.take_sync(Some(counter));
                for foot in feet.iter().filter(|foot| k % 10 == foot.phase) {
                    let jitter = (k * 7919 % 13) as f64;
                    let robot_us = k as f64 * 10_000.0 + jitter;
                    let own_us = foot.begins_us + robot_us * (1.0 + foot.ppm * 1.0e-6);
                    let time = LongTime(((own_us / 10.0).floor() as u64 & 0xFFFF_FFFF) as u32);
                    self.report(foot.node, counter, time);
                }
            }
        }

        fn report(&mut self, node: u8, counter: u8, time: LongTime) {
            self.clocks.take(&Heard {
                at: Timestamp::default(),
                foot: FootKey {
                    line: "can0".into(),
                    node: Some(node),
                },
                said: Said::Health(Health {
                    flags: 0,
                    register: 0,
                    dropped: 0,
                    clock: ClockReading {
                        sync: counter,
                        time,
                    },
                }),
            });
        }

        fn compared(&self) -> Comparison {
            let (_, compared) = self.clocks.compare().expect("two feet");
            compared[0].clone()
        }
    }

    #[test]
    fn offset_and_drift_errors_hold_for_interleaved_reports() {
        for (phase, overflow) in (0..10).zip([240, 240, 10, 19, 100, 50, 240, 12, 20, 30]) {
            let mut bench = Bench::new();
            bench.overflow = overflow;
            bench.run(&[
                Foot::new(0x11, 5_000_000.0, 0.0, 0),
                Foot::new(0x12, 6_234_567.0, 20.0, phase),
            ]);
            let compared = bench.compared();
            // The offset applies to the middle of the ten seconds.
            let true_offset = 1_234_567.0 + 20.0 * 5.0;
            let error = (compared.offset_us - true_offset).abs();
            assert!(error <= compared.offset_error_us, "{phase}: {compared:?}");
            let error = (compared.drift_ppm - 20.0).abs();
            assert!(error <= compared.drift_error_ppm, "{phase}: {compared:?}");
            assert!(compared.drift_error_ppm < 3.0, "{compared:?}");
            assert!(compared.offset_error_us < 25.0, "{compared:?}");
        }
    }

    #[test]
    fn wrapping_clock_is_unwrapped() {
        let mut bench = Bench::new();
        let before_the_end = 4_294_967_296.0 * 10.0 - 4.0e6;
        bench.run(&[
            Foot::new(0x11, 0.0, 0.0, 3),
            Foot::new(0x12, before_the_end, -30.0, 3),
        ]);
        let compared = bench.compared();
        assert!((compared.drift_ppm + 30.0).abs() <= compared.drift_error_ppm);
    }

    #[test]
    fn restart_discards_earlier_reports_of_the_foot() {
        let still = Foot::new(0x11, 0.0, 0.0, 0);
        let mut bench = Bench::new();
        bench.run(&[still, Foot::new(0x12, 9.0e6, 500.0, 0)]);
        bench.clocks.take(&Heard {
            at: Timestamp::default(),
            foot: FootKey {
                line: "can0".into(),
                node: Some(0x12),
            },
            said: Said::BootUp(Faults::NONE),
        });
        assert_eq!(bench.clocks.interruptions(), 1);
        // The other foot continues.
        let still = Foot::new(0x11, 1.0e7, 0.0, 0);
        bench.run(&[still, Foot::new(0x12, 1.0e7, 0.0, 0)]);
        let compared = bench.compared();
        assert!(
            compared.offset_us.abs() <= compared.offset_error_us,
            "{compared:?}"
        );
        assert!(
            compared.drift_ppm.abs() <= compared.drift_error_ppm,
            "{compared:?}"
        );
        // A missed boot-up is detected by the clock going back.
        let still = Foot::new(0x11, 2.0e7, 0.0, 0);
        bench.run(&[still, Foot::new(0x12, 3.0e6, 0.0, 0)]);
        assert_eq!(bench.clocks.interruptions(), 2);
        assert!((bench.compared().offset_us + 1.7e7).abs() < 10.0);
    }

    #[test]
    fn errors_name_the_missing_input() {
        let mut bench = Bench::new();
        assert_eq!(bench.clocks.compare(), Err(SyncError::NoSync));
        bench.clocks.take_sync(None);
        bench.report(0x11, 0, LongTime(55));
        assert_eq!(bench.clocks.compare(), Err(SyncError::NoNumbers));
        let mut bench = Bench::new();
        bench.run(&[Foot::new(0x11, 0.0, 0.0, 0)]);
        assert_eq!(bench.clocks.compare(), Err(SyncError::TooFew(1)));
        bench.report(0x12, 1, LongTime(1));
        assert_eq!(bench.clocks.compare(), Err(SyncError::TooShort(1)));
        // A second master has its own counter.
        for number in [50, 1, 51, 2, 52, 3] {
            bench.clocks.take_sync(Some(number));
        }
        assert_eq!(bench.clocks.compare(), Err(SyncError::SeveralMasters));
    }
}
