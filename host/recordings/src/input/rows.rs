//! Rows of a recording while it is read: on one clock, and in order, or repaired until they are.
//!
//! A reader appends the rows to [`Rows`], whose end is a [`Stored`].

use std::io;

use estimator_core::Timestamp;

use crate::hint::Notice;
use crate::input::error::{InputError, Problem};
use crate::input::options::InputOptions;
use crate::input::rate::{
    Steps, jittering, longest_increase, mean_rate, median, moved, rate_near, sample_rate,
};
use crate::input::smooth::{Smoothed, smoothed};
use crate::input::stored::{About, Stored, Timing};
use crate::input::table::options::Times;
use crate::samples::{RecordedSample, steady_time};
use crate::spool::Spool;

/// Rows of one recording.
#[derive(Default)]
pub(super) struct Rows {
    times: Times,
    spool: Spool,
    clock: Option<Clock>,
    steps: Steps,
    /// Times of the clock, µs, if they need not be in order.
    unordered_us: Vec<i64>,
    pub(super) repairs: Repairs,
}

impl Rows {
    pub(super) fn new(times: Times) -> Self {
        Self { times, ..Self::default() }
    }

    /// Appends a row. `clock_us` is the time of the file's clock, µs, given for all rows or for none.
    ///
    /// # Errors
    /// The time must increase and does not, or the temporary file cannot be written.
    pub(super) fn push(
        &mut self,
        clock_us: Option<i64>,
        mut sample: RecordedSample,
    ) -> Result<(), Refused> {
        if let Some(now_us) = clock_us {
            let stored = match self.times {
                Times::Keep => self.advance_to(now_us)?,
                Times::DropBad | Times::Smooth | Times::Rate => {
                    self.unordered_us.push(now_us);
                    Timestamp::from_micros(now_us.cast_unsigned())
                }
            };
            sample.imu.timestamp = stored;
        }
        self.spool.push(&sample).map_err(Refused::Spool)
    }

    /// Returns the usual step between rows so far, µs; `None` where it is unknown.
    pub(super) fn usual_step_us(&self) -> Option<u64> {
        median(&self.steps.sorted())
    }

    /// Advances the clock, and returns the time since the first row.
    ///
    /// # Errors
    /// The time is not after that of the previous row.
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

    /// Ends the recording of the file at `file`. The rows determine samples, duration, rate, start and repairs of
    /// `about`, and its gravity is replaced by a given one.
    ///
    /// # Errors
    /// There is no row, too many times are out of order, or the sample rate is unknown or contradicts the given one.
    pub(super) fn finish(
        mut self,
        file: &str,
        mut about: About,
        input_options: &InputOptions,
    ) -> Result<Stored, InputError> {
        if self.spool.is_empty() {
            return Err(InputError::empty(file));
        }
        let mut samples = self.spool.len();
        let mut even_rate = None;
        let timing = match self.times {
            Times::DropBad if !self.unordered_us.is_empty() => {
                let kept = self.drop_bad().map_err(|problem| InputError::of_file(file, problem))?;
                samples -= self.repairs.dropped_rows;
                Timing::Clock { kept }
            }
            Times::Smooth if !self.unordered_us.is_empty() => {
                let smoothed = self.smooth();
                let Smoothed { times_us, rate, gaps } = smoothed.ok_or_else(|| {
                    let problem = Problem::UnknownSampleRate { time_column: None };
                    InputError::of_file(file, problem)
                })?;
                samples -= self.repairs.dropped_rows;
                even_rate = Some(rate_near(rate, input_options.sample_rate, file)?);
                about.notices.extend(smoothed_notice(file, gaps));
                Timing::Smoothed { times_us }
            }
            Times::Keep if self.clock.is_some() => Timing::Stored,
            Times::Rate => {
                even_rate = self.space_evenly(input_options.sample_rate);
                Timing::Steady
            }
            Times::Keep | Times::DropBad | Times::Smooth => Timing::Steady,
        };
        let sample_rate = match even_rate {
            Some(rate) => rate as f32,
            None => sample_rate(&self.steps, input_options.sample_rate, file)?,
        };
        let duration_us = match (&timing, self.clock) {
            (Timing::Steady, _) | (_, None) => steady_time(samples - 1, sample_rate).as_micros(),
            (_, Some(clock)) => clock.newest_us.abs_diff(clock.start_us),
        };
        let repaired = self.repairs.notices(file);
        about.notices.extend(repaired.into_iter().map(Notice::from));
        let about = About {
            samples,
            duration_us,
            sample_rate,
            gravity: input_options.gravity.unwrap_or(about.gravity),
            start_us: self.clock.map_or(0, |clock| clock.start_us),
            repairs: self.repairs,
            ..about
        };
        Ok(Stored::new(about, self.spool, timing))
    }

    /// Leaves out the rows whose times do not advance. Returns a flag for each row: whether it is kept.
    ///
    /// # Errors
    /// The times jitter, so that good rows would be left out.
    fn drop_bad(&mut self) -> Result<Vec<bool>, Problem> {
        let kept = longest_increase(&self.unordered_us);
        let (rows, of) = (jittering(&self.unordered_us, &kept), kept.len());
        if rows as f64 > MOST_JITTERING * of as f64 {
            return Err(Problem::Jitter { rows, of });
        }
        let rows = self.unordered_us.iter().zip(&kept);
        for (time_us, _) in rows.filter(|(_, kept)| **kept) {
            let clock = self.clock.get_or_insert(Clock::at(*time_us));
            if clock.newest_us < *time_us {
                self.steps.add(time_us.abs_diff(clock.newest_us));
                clock.newest_us = *time_us;
            }
        }
        self.repairs.dropped_rows = kept.iter().filter(|kept| !**kept).count();
        Ok(kept)
    }

    /// Smooths the times between gaps; `None` if they do not advance.
    fn smooth(&mut self) -> Option<Smoothed> {
        let smoothed = smoothed(&self.unordered_us)?;
        let half_period_us = 0.5e6 / smoothed.rate;
        let rows = || self.unordered_us.iter().zip(&smoothed.times_us);
        let is_moved = |(stamp_us, time_us): &(&i64, &Option<i64>)| {
            time_us.is_some_and(|time_us| time_us.abs_diff(**stamp_us) as f64 > half_period_us)
        };
        self.repairs.retimed_rows = rows().filter(is_moved).count();
        self.repairs.dropped_rows = rows().filter(|(_, time_us)| time_us.is_none()).count();
        let mut times = smoothed.times_us.iter().flatten();
        let start_us = *times.next()?;
        let newest_us = *times.next_back().unwrap_or(&start_us);
        self.clock = Some(Clock { start_us, newest_us });
        Some(smoothed)
    }

    /// Spaces the rows evenly at the sample rate, which is returned, Hz; `None` if it is unknown.
    fn space_evenly(&mut self, given: Option<f32>) -> Option<f64> {
        self.clock = Some(Clock::at(*self.unordered_us.first()?));
        let rate = given.map(f64::from).or_else(|| mean_rate(&self.unordered_us))?;
        self.repairs.retimed_rows = moved(&self.unordered_us, rate);
        Some(rate)
    }
}

/// First and newest time of the file's clock, µs.
#[derive(Clone, Copy)]
struct Clock {
    start_us: i64,
    newest_us: i64,
}

/// Reason why a row was rejected.
pub(super) enum Refused {
    /// Its time is not after that of the previous row.
    Time {
        /// Time of the previous row, µs.
        previous_us: i64,
    },
    /// The temporary file cannot be written.
    Spool(io::Error),
}

impl Refused {
    /// Error about times that cannot be attributed to a cell.
    pub(super) fn into_error(self, file: &str) -> InputError {
        match self {
            Self::Time { previous_us } => {
                InputError::of_file(file, Problem::MessageOrder { previous_us })
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

/// Counts of rows that were left out or got another time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Rows left out because all six axes are blank in them.
    pub blank_rows: usize,
    /// Rows left out because their times do not advance.
    pub dropped_rows: usize,
    /// Rows whose time was changed.
    pub retimed_rows: usize,
}

impl Repairs {
    /// One sentence for each kind of repair that occurred.
    pub(super) fn notices(self, file: &str) -> Vec<String> {
        let blank = "left out, in which all six axes are blank";
        let dropped = "left out, whose times do not advance";
        let retimed = "moved by more than half a period, to where the sample rate has them";
        let sentence = |(rows, what)| match rows {
            0 => None,
            1 => Some(format!("{file}: 1 row {what}")),
            _ => Some(format!("{file}: {rows} rows {what}")),
        };
        let rows = [self.blank_rows, self.dropped_rows, self.retimed_rows];
        let counted = rows.into_iter().zip([blank, dropped, retimed]);
        counted.filter_map(sentence).collect()
    }
}

/// Largest share of rows that may be left out because their times jitter. With more, the error advises to smooth the times.
const MOST_JITTERING: f64 = 0.01;

/// Sentence about the gaps between smooth times.
fn smoothed_notice(file: &str, gaps: usize) -> Option<Notice> {
    let text = match gaps {
        0 => return None,
        1 => format!("{file}: times are smooth up to a gap and after it"),
        _ => format!("{file}: times are smooth between {gaps} gaps"),
    };
    Some(Notice::from(text))
}
