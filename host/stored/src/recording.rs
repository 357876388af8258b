//! Recording that is read from a file, with its samples in a [`Spool`].
//!
//! A reader of a format appends its rows to [`Rows`], which puts them on one clock and in order, or repairs them until
//! they are. The result is a [`Stored`]. Its samples are read back with their times and along the axes of the foot. If
//! the contacts of a bag are the estimates, each is read with the newest sample at its time.

use std::io;

use estimator_core::{ContactEstimate, Gravity, ImuSample, LinearAcceleration, Timestamp};

use crate::contacts::{Contacts, SentContact, SpanAndRate};
use crate::error::{InputError, Problem};
use crate::jitter::{Evenness, jitters};
use crate::live::LiveTimes;
use crate::rate::{jittering, longest_increase, mean_rate, moved, rate_near, sample_rate};
use crate::smooth::{Smoothed, smoothed};
use crate::spool::{Spool, SpooledRows};
use options::hint::{Hint, Notice};
use options::{Correction, InputOptions, Times};
use samples::steps::{Steps, median};
use samples::{RecordedSample, Recording, steady_time};

/// A recording that has been read. Its memory does not grow with its length.
pub struct Stored {
    /// Properties of the recording.
    pub about: About,
    spool: Spool,
    timing: Timing,
    /// Contacts that are the estimates.
    contacts: Option<UsedContacts>,
}

impl Stored {
    const fn new(about: About, spool: Spool, timing: Timing) -> Self {
        Self { about, spool, timing, contacts: None }
    }

    /// Makes these contacts the estimates, and describes them instead of the samples. If there are fewer than two,
    /// returns false and changes nothing.
    pub fn use_contacts(&mut self, contacts: Contacts) -> bool {
        let Some(SpanAndRate { first_us, last_us, rate }) = contacts.span_and_rate() else {
            return false;
        };
        let clock = self.clock_of_samples();
        let about = &mut self.about;
        (about.start_us, about.sample_rate) = (first_us, rate);
        about.samples = contacts.count();
        about.duration_us = last_us.abs_diff(first_us);
        self.contacts = Some(UsedContacts { contacts, clock });
        true
    }

    /// Creates the recording of a foot that has these contacts but no samples; `None` for fewer than two contacts.
    #[must_use]
    pub fn of_contacts(name: String, foot: Option<String>, contacts: Contacts) -> Option<Self> {
        let about = About { foot, ..About::new(name, 1.0, Gravity::Included) };
        let mut stored = Self::new(about, Spool::default(), Timing::Stored);
        stored.use_contacts(contacts).then_some(stored)
    }

    /// Returns whether the estimates are recorded contacts.
    #[must_use]
    pub const fn has_estimates(&self) -> bool {
        self.contacts.is_some()
    }

    /// Returns the recorded estimates, from the first; `None` if they are to be computed from the samples.
    ///
    /// # Errors
    /// A temporary file cannot be written or read.
    pub fn estimates(
        &mut self,
    ) -> io::Result<Option<impl Iterator<Item = io::Result<RecordedEstimate>> + '_>> {
        let clock = self.clock_of_samples();
        let Some(UsedContacts { contacts, .. }) = &mut self.contacts else {
            return Ok(None);
        };
        Ok(Some(RecordedEstimates {
            contacts: contacts.read()?,
            start_us: self.about.start_us,
            samples: TimedSamples::new(
                &mut self.spool,
                &self.timing,
                self.about.correction,
                clock,
            )?,
            newest: None,
            is_used: false,
            next: None,
        }))
    }

    /// Stores a recording that is in memory and whose times begin at 0; `file` is the path that it was read from.
    pub fn from_recording(
        recording: Recording,
        notices: Vec<Notice>,
        file: &str,
    ) -> Result<Self, InputError> {
        let mut spool = Spool::default();
        let mut samples = recording.samples.iter();
        samples
            .try_for_each(|sample| spool.push(sample))
            .map_err(|source| InputError::spool(file, source))?;
        let last = recording.samples.last();
        let about = About {
            samples: recording.samples.len(),
            duration_us: last.map_or(0, |sample| sample.imu.timestamp.as_micros()),
            load_title: recording.load_title,
            notices,
            ..About::new(recording.name, recording.sample_rate, recording.gravity)
        };
        Ok(Self::new(about, spool, Timing::Stored))
    }

    /// Start and rate of [`Self::samples`], even if contacts are described instead.
    #[must_use]
    pub const fn clock_of_samples(&self) -> SampleClock {
        match &self.contacts {
            Some(used) => used.clock,
            None => {
                SampleClock { start_us: self.about.start_us, sample_rate: self.about.sample_rate }
            }
        }
    }

    /// Returns all samples, from the first.
    ///
    /// # Errors
    /// The temporary file with the samples cannot be written or read.
    pub fn samples(&mut self) -> io::Result<impl Iterator<Item = io::Result<RecordedSample>> + '_> {
        let clock = self.clock_of_samples();
        TimedSamples::new(&mut self.spool, &self.timing, self.about.correction, clock)
    }

    /// Returns the recording with all samples in memory.
    ///
    /// # Errors
    /// The errors of [`Self::samples`].
    pub fn into_loaded(mut self) -> io::Result<Loaded> {
        let samples = self.samples()?.collect::<io::Result<Vec<_>>>()?;
        let about = self.about;
        Ok(Loaded {
            recording: Recording {
                name: about.name,
                sample_rate: about.sample_rate,
                gravity: about.gravity,
                load_title: about.load_title,
                samples,
            },
            start_us: about.start_us,
            notices: about.notices,
            repairs: about.repairs,
        })
    }
}

/// Start and rate of the samples of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleClock {
    /// Time of the file's clock at the first sample, µs.
    pub start_us: i64,
    /// Samples per second.
    pub sample_rate: f32,
}

/// Properties of a recording other than its samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Name of the source, for titles and messages.
    pub name: String,
    /// Name of the foot, if the file has several or names it.
    pub foot: Option<String>,
    /// Topic of the foot in a bag, with its frame if the topic has several.
    pub address: Option<String>,
    /// Number of samples.
    pub samples: usize,
    /// Duration from the first sample to the last, µs. The first is at time 0.
    pub duration_us: u64,
    /// Samples per second.
    pub sample_rate: f32,
    /// Whether the accelerations contain gravity.
    pub gravity: Gravity,
    /// Name and unit of the load signal, such as `vertical force (N)`.
    pub load_title: String,
    /// Time of the file's clock at the first sample, µs; 0 if the file has no clock. It may be negative, as before
    /// a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence for each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<Notice>,
    /// Rows that were left out or whose time was changed.
    pub repairs: Repairs,
    /// Calibration and mounting of the sensor that are applied to the samples.
    pub correction: Correction,
    /// Times of the file's clock and of writing, µs, for some samples of a bag, in order.
    pub anchors_us: Vec<(i64, i64)>,
}

impl About {
    /// Creates the properties of an empty recording without a name.
    #[must_use]
    pub fn new(name: String, sample_rate: f32, gravity: Gravity) -> Self {
        Self { name, sample_rate, gravity, ..Self::default() }
    }

    /// Time at which a sample was written to its bag, µs. `time_us` is on the file's clock, and the result if no
    /// other time is known.
    #[must_use]
    pub fn written_us(&self, time_us: i64) -> i64 {
        let after = self.anchors_us.partition_point(|(time, _)| *time <= time_us);
        let anchor = self.anchors_us.get(after.saturating_sub(1));
        anchor.map_or(time_us, |(time, written)| time_us.saturating_add(written - time))
    }

    /// Name of the foot, or of the recording if the foot has none.
    #[must_use]
    pub fn foot_or_name(&self) -> &str {
        self.foot.as_deref().unwrap_or(&self.name)
    }

    /// Name of the foot in tables and plots: the recording's name, then its own if it has one.
    #[must_use]
    pub fn title(&self) -> String {
        match &self.foot {
            Some(foot) => format!("{} {foot}", self.name),
            None => self.name.clone(),
        }
    }

    /// Names by which settings of single feet apply: [`Self::foot_or_name`], and, if only one foot was read from a bag,
    /// each part of its topic.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let address = self.address.as_deref().filter(|_| self.foot.is_none());
        let parts = address.into_iter().flat_map(|address| address.split('/'));
        let parts = parts.filter(|part| !part.is_empty());
        [self.foot_or_name()].into_iter().chain(parts).collect()
    }

    /// Names of [`Self::names`], and `foot` if the file does not name its foot.
    #[must_use]
    pub fn names_with<'a>(&'a self, foot: Option<&'a str>) -> Vec<&'a str> {
        let other = foot.filter(|_| self.foot.is_none());
        self.names().into_iter().chain(other).collect()
    }

    /// Time from the first sample to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_us as f64 / 1.0e6
    }
}

/// A recording that has been read, with all samples in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Recording. Its first sample is at time 0.
    pub recording: Recording,
    /// Time of the file's clock at the first sample, µs; 0 if the file has no clock. It may be negative, as before
    /// a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence for each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<Notice>,
    /// Rows that were left out or whose time was changed.
    pub repairs: Repairs,
}

/// Rows of a recording while they are read: on one clock and in order, or repaired until they are.
#[derive(Default)]
pub struct Rows {
    times: Times,
    spool: Spool,
    clock: Option<Clock>,
    steps: Steps,
    evenness: Evenness,
    /// Times of the clock, µs, if they need not be in order.
    unordered_us: Vec<i64>,
    /// Rows left out so far.
    pub repairs: Repairs,
    /// Newest row of a stream, whose rows are not kept; `None` after it was taken.
    newest: Option<RecordedSample>,
    is_stream: bool,
    /// Smooths the times of a stream that jitter; `None` if they are kept.
    live: Option<LiveTimes>,
    /// Whether there was a row.
    has_rows: bool,
}

/// Sample of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamedSample {
    /// Sample with its time since the first one; if the stream has no times, at time 0. It is not corrected.
    pub sample: RecordedSample,
    /// Time of the stream's clock at the first sample, µs; `None` if the stream has no times.
    pub start_us: Option<i64>,
}

impl Rows {
    /// Creates the rows of a stream, which are not kept, because each is taken before the next.
    #[must_use]
    pub fn of_stream(times: Times) -> Self {
        let live = (times == Times::Auto).then(LiveTimes::default);
        Self { times, is_stream: true, live, ..Self::default() }
    }

    /// Takes the newest row of a stream.
    pub fn take_newest(&mut self) -> Option<StreamedSample> {
        let sample = self.newest.take()?;
        Some(StreamedSample { sample, start_us: self.clock.map(|clock| clock.start_us) })
    }

    /// Returns whether the times of a stream jitter now, and are smoothed.
    #[must_use]
    pub fn is_smoothing(&self) -> bool {
        self.live.as_ref().is_some_and(LiveTimes::is_smoothing)
    }

    /// Starts a recording whose times are treated like this.
    #[must_use]
    pub fn new(times: Times) -> Self {
        Self { times, ..Self::default() }
    }

    /// Appends a row. `clock_us` is the time of the file's clock, µs, given for all rows or for none.
    ///
    /// # Errors
    /// The time must increase and does not, or the temporary file cannot be written.
    pub fn push(
        &mut self,
        clock_us: Option<i64>,
        mut sample: RecordedSample,
    ) -> Result<(), Refused> {
        if let Some(now_us) = clock_us {
            let stored = match self.times {
                Times::Auto | Times::Keep => {
                    let since_us = self.advance_to(now_us)?;
                    self.live.as_mut().zip(self.clock).map_or(since_us, |(live, clock)| {
                        let time_us = live.time_us(now_us).saturating_sub(clock.start_us);
                        Timestamp::from_micros(time_us.max(0).cast_unsigned())
                    })
                }
                // These treatments need the times of all rows. Until then the sample has the time of the clock, which
                // `TimedSamples` replaces by the time since the first row.
                Times::DropBad | Times::Smooth | Times::Rate => {
                    self.unordered_us.push(now_us);
                    Timestamp::from_micros(now_us.cast_unsigned())
                }
            };
            sample.imu.timestamp = stored;
        }
        self.has_rows = true;
        if self.is_stream {
            self.newest = Some(sample);
            return Ok(());
        }
        self.spool.push(&sample).map_err(Refused::Spool)
    }

    /// Returns the time of the newest row, µs; `None` without one.
    #[must_use]
    pub fn newest_us(&self) -> Option<i64> {
        let newest = self.clock.map(|clock| clock.newest_us);
        newest.or_else(|| self.unordered_us.last().copied())
    }

    /// Returns the usual step between rows so far, µs; `None` where it is unknown.
    pub fn usual_step_us(&self) -> Option<u64> {
        median(&self.steps.sorted())
    }

    /// Advances the clock, and returns the time since the first row.
    ///
    /// # Errors
    /// The time is not after the time of the previous row.
    fn advance_to(&mut self, now_us: i64) -> Result<Timestamp, Refused> {
        let clock = self.clock.get_or_insert(Clock::at(now_us));
        if self.has_rows {
            let previous_us = clock.newest_us;
            if now_us <= previous_us {
                return Err(Refused::Time { previous_us, repeats: now_us == previous_us });
            }
            let step_us = now_us.abs_diff(previous_us);
            self.steps.add(step_us);
            self.evenness.add(step_us);
            clock.newest_us = now_us;
        }
        Ok(Timestamp::from_micros(now_us.abs_diff(clock.start_us)))
    }

    /// Ends the recording of the file at `file`. The rows determine samples, duration, rate, start and repairs of
    /// `about`, and its gravity is replaced by a given one.
    ///
    /// # Errors
    /// There is no row, too many times are out of order, or the sample rate is unknown or contradicts the given one.
    pub fn finish(
        mut self,
        file: &str,
        mut about: About,
        input_options: &InputOptions,
    ) -> Result<Stored, InputError> {
        if self.spool.is_empty() {
            return Err(InputError::empty(file));
        }
        if self.times == Times::Auto && jitters(&self.steps, &self.evenness) {
            about.notices.extend(self.smooth_by_itself(file)?);
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
            Times::Auto | Times::Keep if self.clock.is_some() => Timing::Stored,
            Times::Rate => {
                even_rate = self.space_evenly(input_options.sample_rate);
                Timing::Steady
            }
            Times::Auto | Times::Keep | Times::DropBad | Times::Smooth => Timing::Steady,
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

    /// Treats times that jitter as if they were to be smoothed, unless they have gaps. Returns a sentence about it.
    fn smooth_by_itself(&mut self, file: &str) -> Result<Option<Notice>, InputError> {
        let start_us = self.clock.map_or(0, |clock| clock.start_us);
        let rows = self.spool.rows().map_err(|source| InputError::spool(file, source))?;
        let stamps_us = rows.map(|row| {
            let since_us = row?.imu.timestamp.as_micros().cast_signed();
            Ok(start_us.saturating_add(since_us))
        });
        let stamps_us = stamps_us.collect::<io::Result<Vec<i64>>>();
        let stamps_us = stamps_us.map_err(|source| InputError::spool(file, source))?;
        let Some(Smoothed { times_us, rate, gaps: 0 }) = smoothed(&stamps_us) else {
            return Ok(None);
        };
        let moves = stamps_us
            .iter()
            .zip(&times_us)
            .filter_map(|(stamp_us, time_us)| time_us.map(|time_us| time_us.abs_diff(*stamp_us)));
        let most_ms = moves.max().unwrap_or(0) as f64 / 1.0e3;
        (self.times, self.unordered_us) = (Times::Smooth, stamps_us);
        let text = format!(
            "{file}: times jitter by up to {most_ms:.1} ms around a steady {rate:.1} Hz, and are smoothed"
        );
        Ok(Some(Notice::with_hint(text, Hint::KeepTimes)))
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

impl Clock {
    const fn at(time_us: i64) -> Self {
        Self { start_us: time_us, newest_us: time_us }
    }
}

/// Reason why a row was rejected.
pub enum Refused {
    /// The time of the row is not after the time of the previous row.
    Time {
        /// Time of the previous row, µs.
        previous_us: i64,
        /// Whether it is the same time.
        repeats: bool,
    },
    /// The temporary file cannot be written.
    Spool(io::Error),
}

impl Refused {
    /// Returns the error about times that cannot be attributed to a cell.
    pub fn into_error(self, file: &str) -> InputError {
        match self {
            Self::Time { previous_us, repeats } => {
                InputError::of_file(file, Problem::MessageOrder { previous_us, repeats })
            }
            Self::Spool(source) => InputError::spool(file, source),
        }
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
    fn notices(self, file: &str) -> Vec<String> {
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

/// Largest share of rows that may be left out because their times jitter. With more, the error advises to smooth the
/// times.
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

/// Source of the time of a sample.
#[derive(Clone, Debug)]
enum Timing {
    /// Stored time since the first sample, as with [`Times::Keep`].
    Stored,
    /// Computed from the sample's index and the sample rate, as with [`Times::Rate`], or because the file has no times.
    Steady,
    /// Time of the file's clock, as with [`Times::DropBad`]; samples whose flag is false are left out.
    Clock { kept: Vec<bool> },
    /// Other times of the file's clock, µs, as with [`Times::Smooth`]; samples without one are left out.
    Smoothed { times_us: Vec<Option<i64>> },
}

/// Iterator over the samples from a spool, with their times and corrected.
struct TimedSamples<'a> {
    samples: SpooledRows<'a, RecordedSample>,
    timing: &'a Timing,
    correction: Correction,
    clock: SampleClock,
    /// Index of the next sample.
    index: usize,
}

impl<'a> TimedSamples<'a> {
    /// Starts at the first sample; `clock` comes from [`Stored::clock_of_samples`].
    fn new(
        spool: &'a mut Spool,
        timing: &'a Timing,
        correction: Correction,
        clock: SampleClock,
    ) -> io::Result<Self> {
        Ok(Self { samples: spool.rows()?, timing, correction, clock, index: 0 })
    }
}

impl Iterator for TimedSamples<'_> {
    type Item = io::Result<RecordedSample>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let mut sample = match self.samples.next()? {
                Ok(sample) => sample,
                Err(error) => return Some(Err(error)),
            };
            let index = self.index;
            self.index += 1;
            let timestamp = &mut sample.imu.timestamp;
            let SampleClock { start_us, sample_rate } = self.clock;
            match self.timing {
                Timing::Stored => {}
                Timing::Steady => *timestamp = steady_time(index, sample_rate),
                Timing::Clock { kept } => {
                    if kept.get(index) == Some(&false) {
                        continue;
                    }
                    let clock_us = timestamp.as_micros().cast_signed();
                    *timestamp = Timestamp::from_micros(clock_us.abs_diff(start_us));
                }
                Timing::Smoothed { times_us } => {
                    let Some(clock_us) = times_us.get(index).copied().flatten() else {
                        continue;
                    };
                    *timestamp = Timestamp::from_micros(clock_us.abs_diff(start_us));
                }
            }
            sample.imu = self.correction.corrected(sample.imu);
            return Some(Ok(sample));
        }
    }
}

/// Contacts that are described in the place of the samples.
struct UsedContacts {
    contacts: Contacts,
    /// Start and rate of the samples.
    clock: SampleClock,
}

/// Estimate that the foot sent, and that was recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedEstimate {
    /// The newest sample at the time of the estimate, with that time. The label comes from a sample of exactly this time,
    /// and the load is at most 100 ms old.
    pub sample: RecordedSample,
    /// Age of that sample, µs, if no earlier estimate had it.
    pub new_age_us: Option<u64>,
    /// Whether the foot sent the estimate as valid, whatever its flags, which may be older.
    pub is_valid: bool,
    /// The estimate; numbers that were not recorded with it are NaN.
    pub estimate: ContactEstimate,
    /// The estimate with the foot's newest acceleration and orientation (at most 25 ms old), as far as they are known.
    pub with_motion: ContactEstimate,
}

/// Age up to which a load with its own stream is valid, µs: half of the shortest stance of a walking robot. It must
/// arrive at 10 Hz or more.
pub const OLDEST_LOAD_US: u64 = 100_000;

/// Iterator over recorded contacts, each with the newest sample at its time.
struct RecordedEstimates<'a> {
    contacts: SpooledRows<'a, SentContact>,
    /// Time of the file's clock at the first contact, µs.
    start_us: i64,
    samples: TimedSamples<'a>,
    /// Newest sample that is not after the contact, with its time of the file's clock, µs.
    newest: Option<(i64, RecordedSample)>,
    /// Whether an estimate has had the newest sample.
    is_used: bool,
    /// The sample after it.
    next: Option<(i64, RecordedSample)>,
}

impl RecordedEstimates<'_> {
    /// Advances to the newest sample at `time_us`.
    fn advance_to(&mut self, time_us: i64) -> io::Result<()> {
        loop {
            if self.next.is_none() {
                let sample = self.samples.next().transpose()?;
                self.next = sample.map(|sample| {
                    let since_us = sample.imu.timestamp.as_micros().cast_signed();
                    (self.samples.clock.start_us.saturating_add(since_us), sample)
                });
            }
            match self.next {
                Some((at_us, _)) if at_us <= time_us => {
                    self.newest = self.next.take();
                    self.is_used = false;
                }
                _ => return Ok(()),
            }
        }
    }

    /// Estimate of the next contact.
    fn estimate(&mut self, contact: SentContact) -> io::Result<RecordedEstimate> {
        let now_us = contact.time_us;
        self.advance_to(now_us)?;
        let timestamp = Timestamp::from_micros(now_us.abs_diff(self.start_us));
        let newest = self.newest.map(|(at_us, newest)| (now_us.abs_diff(at_us), newest));
        let is_used = std::mem::replace(&mut self.is_used, true);
        let new_age_us = newest.filter(|_| !is_used).map(|(age_us, _)| age_us);
        let sample = RecordedSample {
            imu: ImuSample {
                timestamp,
                ..newest.map_or_else(ImuSample::default, |(_, newest)| newest.imu)
            },
            load: newest
                .and_then(|(age_us, newest)| newest.load.filter(|_| age_us <= OLDEST_LOAD_US)),
            label: newest.and_then(|(age_us, newest)| newest.label.filter(|_| age_us == 0)),
        };
        let estimate = contact.estimate(timestamp);
        let with_motion = ContactEstimate {
            orientation: contact.orientation,
            linear_acceleration: LinearAcceleration(contact.acceleration),
            ..estimate
        };
        Ok(RecordedEstimate {
            sample,
            new_age_us,
            is_valid: contact.is_valid,
            estimate,
            with_motion,
        })
    }
}

impl Iterator for RecordedEstimates<'_> {
    type Item = io::Result<RecordedEstimate>;

    fn next(&mut self) -> Option<Self::Item> {
        let contact = self.contacts.next()?;
        Some(contact.and_then(|contact| self.estimate(contact)))
    }
}
