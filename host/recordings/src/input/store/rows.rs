//! Rows of a recording as they are read, independent of their source: order, clock and rate.

use std::io;

use crate::samples::recording::RecordedSample;
use estimator_core::Timestamp;

use super::rate::sample_rate;
use super::stored::{About, Stored, Timing};
use super::times::{longest_increase, mean_rate, moved};
use crate::input::error::InputError;
use crate::input::loaded::{Hints, Repairs, steady_time};
use crate::input::table::options::Times;
use crate::spool::Spool;
use crate::steps::Steps;

/// Rows of one recording.
#[derive(Default)]
pub(in crate::input) struct Rows {
    times: Times,
    spool: Spool,
    clock: Option<Clock>,
    steps: Steps,
    /// Times of the clock, µs, if they need not be in order.
    unordered_us: Vec<i64>,
    pub(in crate::input) repairs: Repairs,
}

/// First and newest time, µs.
#[derive(Clone, Copy)]
struct Clock {
    start_us: i64,
    newest_us: i64,
}

/// Reason why a row was rejected.
pub(in crate::input) enum Refused {
    /// Its time is not after that of the previous row, µs.
    Time {
        previous_us: i64,
    },
    Spool(io::Error),
}

impl Refused {
    /// Error about times that cannot be attributed to a cell.
    pub(in crate::input) fn into_error(self, file: &str) -> InputError {
        match self {
            Self::Time { previous_us } => {
                InputError::MessageOrder { file: file.to_owned(), previous_us }
            }
            Self::Spool(source) => InputError::spool(file, source),
        }
    }
}

impl Clock {
    const fn at(time_us: i64) -> Self {
        Self { start_us: time_us, newest_us: time_us }
    }
}

impl Rows {
    pub(in crate::input) fn new(times: Times) -> Self {
        Self { times, ..Self::default() }
    }

    /// Appends a row; `clock_us` is the time of the file's clock, given for all rows or for none.
    pub(in crate::input) fn push(
        &mut self,
        clock_us: Option<i64>,
        mut sample: RecordedSample,
    ) -> Result<(), Refused> {
        if let Some(now_us) = clock_us {
            let stored = match self.times {
                Times::Keep => self.advance_to(now_us)?,
                Times::DropBad | Times::Rate => {
                    self.unordered_us.push(now_us);
                    Timestamp::from_micros(now_us.cast_unsigned())
                }
            };
            sample.imu.timestamp = stored;
        }
        self.spool.push(&sample).map_err(Refused::Spool)
    }

    /// Time since the first row.
    fn advance_to(&mut self, now_us: i64) -> Result<Timestamp, Refused> {
        let clock = self.clock.get_or_insert(Clock::at(now_us));
        if !self.spool.is_empty() {
            let previous_us = clock.newest_us;
            if now_us <= previous_us {
                return Err(Refused::Time { previous_us });
            }
            self.steps.add(now_us.abs_diff(previous_us));
            clock.newest_us = now_us;
        }
        Ok(Timestamp::from_micros(now_us.abs_diff(clock.start_us)))
    }

    /// Returns the recording of the file at `file`. Of `about`, samples, duration, rate, units, start and repairs are
    /// replaced by those of the rows, and gravity by the given one.
    pub(in crate::input) fn finish(
        mut self,
        file: &str,
        mut about: About,
        hints: &Hints,
    ) -> Result<Stored, InputError> {
        if self.spool.is_empty() {
            return Err(InputError::empty(file));
        }
        let mut samples = self.spool.len();
        let mut even_rate = None;
        let timing = match self.times {
            Times::DropBad if !self.unordered_us.is_empty() => {
                let kept = self.drop_bad();
                samples -= self.repairs.dropped_rows;
                Timing::Clock { kept }
            }
            Times::Keep if self.clock.is_some() => Timing::Stored,
            Times::Rate => {
                even_rate = self.space_evenly(hints.sample_rate);
                Timing::Steady
            }
            Times::Keep | Times::DropBad => Timing::Steady,
        };
        let sample_rate = match even_rate {
            Some(rate) => rate as f32,
            None => sample_rate(&self.steps, hints.sample_rate, file)?,
        };
        let duration_us = match (&timing, self.clock) {
            (Timing::Steady, _) | (_, None) => steady_time(samples - 1, sample_rate).as_micros(),
            (_, Some(clock)) => clock.newest_us.abs_diff(clock.start_us),
        };
        about.notices.extend(self.repairs.notices(file));
        let about = About {
            samples,
            duration_us,
            sample_rate,
            gravity: hints.gravity.unwrap_or(about.gravity),
            start_us: self.clock.map_or(0, |clock| clock.start_us),
            repairs: self.repairs,
            ..about
        };
        Ok(Stored::new(about, self.spool, timing))
    }

    /// Leaves out the rows whose times do not advance; returns the flags of those that are kept.
    fn drop_bad(&mut self) -> Vec<bool> {
        let kept = longest_increase(&self.unordered_us);
        let rows = self.unordered_us.iter().zip(&kept);
        for (time_us, _) in rows.filter(|(_, kept)| **kept) {
            let clock = self.clock.get_or_insert(Clock::at(*time_us));
            if clock.newest_us < *time_us {
                self.steps.add(time_us.abs_diff(clock.newest_us));
                clock.newest_us = *time_us;
            }
        }
        self.repairs.dropped_rows = kept.iter().filter(|kept| !**kept).count();
        kept
    }

    /// Spaces the rows evenly at the sample rate, which is returned, Hz; `None` if it is unknown.
    fn space_evenly(&mut self, given: Option<f32>) -> Option<f64> {
        self.clock = Some(Clock::at(*self.unordered_us.first()?));
        let rate = given.map(f64::from).or_else(|| mean_rate(&self.unordered_us))?;
        self.repairs.retimed_rows = moved(&self.unordered_us, rate);
        Some(rate)
    }
}
