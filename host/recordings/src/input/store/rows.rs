//! Rows of a recording as they are read, independent of their source: order, clock and rate.

use std::io;

use estimator_core::{Gravity, Timestamp};
use samples::recording::RecordedSample;

use super::rate::sample_rate;
use super::stored::{About, Stored, Timing};
use super::times::{longest_increase, mean_rate, moved};
use crate::input::error::InputError;
use crate::input::loaded::{Hints, Repairs, steady_time};
use crate::input::table::options::Times;
use crate::spool::Spool;
use crate::steps::Steps;

/// Properties of a recording known from its source.
pub(in crate::input) struct Source<'a> {
    /// Path of the file, as given.
    pub(in crate::input) file: &'a str,
    pub(in crate::input) name: String,
    pub(in crate::input) foot: Option<String>,
    /// Whether the accelerations contain gravity by default.
    pub(in crate::input) gravity: Gravity,
    pub(in crate::input) load_title: String,
    pub(in crate::input) notices: Vec<String>,
}

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
            Self::Time { previous_us } => InputError::MessageOrder {
                file: file.to_owned(),
                previous_us,
            },
            Self::Spool(source) => InputError::spool(file, source),
        }
    }
}

impl Clock {
    const fn at(time_us: i64) -> Self {
        Self {
            start_us: time_us,
            newest_us: time_us,
        }
    }
}

impl Rows {
    pub(in crate::input) fn new(times: Times) -> Self {
        Self {
            times,
            ..Self::default()
        }
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

    /// Flags of the rows that are kept, if some may be left out.
    pub(in crate::input) fn kept(&self) -> Option<Vec<bool>> {
        (self.times == Times::DropBad).then(|| longest_increase(&self.unordered_us))
    }

    /// Returns the recording, with the rows selected by [`Self::kept`].
    pub(in crate::input) fn finish(
        mut self,
        source: Source<'_>,
        hints: &Hints,
        kept: Option<Vec<bool>>,
    ) -> Result<Stored, InputError> {
        if self.spool.is_empty() {
            return Err(InputError::empty(source.file));
        }
        let mut spacing = None;
        let has_clock = self.clock.is_some() || !self.unordered_us.is_empty();
        match (self.times, kept) {
            (Times::DropBad, Some(kept)) if has_clock => self.drop_bad(&kept, &mut spacing),
            (Times::Rate, _) if has_clock => self.space_evenly(hints.sample_rate, &mut spacing),
            _ => {}
        }
        let rate = match &spacing {
            Some(Spacing::Even(rate)) => *rate as f32,
            _ => sample_rate(&self.steps, hints.sample_rate, source.file)?,
        };
        let (timing, samples) = match spacing {
            Some(Spacing::Kept(kept)) => {
                let samples = kept.iter().filter(|kept| **kept).count();
                (Timing::Clock { kept }, samples)
            }
            None if self.clock.is_some() => (Timing::Stored, self.spool.len()),
            Some(Spacing::Even(_)) | None => (Timing::Steady, self.spool.len()),
        };
        let clock = self.clock;
        let duration_us = match (&timing, clock) {
            (Timing::Steady, _) | (_, None) => steady_time(samples - 1, rate).as_micros(),
            (_, Some(clock)) => clock.newest_us.abs_diff(clock.start_us),
        };
        let mut notices = source.notices;
        notices.extend(self.repairs.notices(source.file));
        let about = About {
            foot: source.foot,
            samples,
            duration_us,
            units: hints.table.units,
            load_title: source.load_title,
            start_us: clock.map_or(0, |clock| clock.start_us),
            notices,
            repairs: self.repairs,
            ..About::new(source.name, rate, hints.gravity.unwrap_or(source.gravity))
        };
        Ok(Stored::new(about, self.spool, timing))
    }

    /// Leaves out the rows whose times do not advance.
    fn drop_bad(&mut self, kept: &[bool], spacing: &mut Option<Spacing>) {
        let rows = self.unordered_us.iter().zip(kept);
        let mut ordered = rows.filter(|(_, kept)| **kept);
        let Some((first, _)) = ordered.next() else {
            return;
        };
        let mut clock = Clock::at(*first);
        for (time, _) in ordered {
            self.steps.add(time.abs_diff(clock.newest_us));
            clock.newest_us = *time;
        }
        self.clock = Some(clock);
        self.repairs.dropped_rows = kept.iter().filter(|kept| !**kept).count();
        *spacing = Some(Spacing::Kept(kept.to_vec()));
    }

    /// Spaces the rows evenly at the sample rate.
    fn space_evenly(&mut self, given: Option<f32>, spacing: &mut Option<Spacing>) {
        let Some(first) = self.unordered_us.first() else {
            return;
        };
        self.clock = Some(Clock::at(*first));
        let given = given.map(f64::from);
        if let Some(rate) = given.or_else(|| mean_rate(&self.unordered_us)) {
            self.repairs.retimed_rows = moved(&self.unordered_us, rate);
            *spacing = Some(Spacing::Even(rate));
        }
    }
}

/// Spacing of rows that do not keep the times of their clock.
enum Spacing {
    /// Times of the clock, without the rows whose flag is false.
    Kept(Vec<bool>),
    /// Constant rate, Hz.
    Even(f64),
}
