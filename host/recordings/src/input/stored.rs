//! Result of reading a file: a recording whose samples are in a [`Spool`].
//!
//! [`Rows`](super::rows::Rows) makes it of the rows of a file. Its samples are read back with their times and along the
//! axes of the foot. If the contacts of a bag are the estimates, these are read with the samples beside them.

use std::io;

use estimator_core::{ContactEstimate, Gravity, ImuSample, LinearAcceleration, Timestamp};

use crate::hint::Notice;
use crate::input::contacts::{Contacts, SentContact};
use crate::input::error::InputError;
use crate::input::options::Correction;
use crate::input::rows::Repairs;
use crate::samples::{RecordedSample, Recording, steady_time};
use crate::spool::{Spool, SpooledRows};

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
    pub(super) const fn new(about: About, spool: Spool, timing: Timing) -> Self {
        Self { about, spool, timing, contacts: None }
    }

    /// Makes these contacts the estimates, and describes them instead of the samples. If there are fewer than two,
    /// returns false and changes nothing.
    pub(super) fn use_contacts(&mut self, contacts: Contacts) -> bool {
        let Some(((first_us, last_us), rate)) = contacts.span_and_rate() else {
            return false;
        };
        let clock = self.clock_of_samples();
        let about = &mut self.about;
        (about.start_us, about.sample_rate) = (first_us, rate);
        about.samples = contacts.len();
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
    pub(super) fn from_recording(
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

    /// Time of the file's clock at the first sample, µs, and samples per second. They are those of [`Self::samples`],
    /// even if contacts are described instead.
    #[must_use]
    pub const fn clock_of_samples(&self) -> (i64, f32) {
        match &self.contacts {
            Some(used) => used.clock,
            None => (self.about.start_us, self.about.sample_rate),
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

    /// Time at which a sample was written to its bag, µs. `time_us` is that of the file's clock, and the result if no
    /// other time is known.
    #[must_use]
    pub fn written_us(&self, time_us: i64) -> i64 {
        let after = self.anchors_us.partition_point(|(time, _)| *time <= time_us);
        let anchor = self.anchors_us.get(after.saturating_sub(1));
        anchor.map_or(time_us, |(time, written)| time_us.saturating_add(written - time))
    }

    /// Name of the foot, or that of the recording if it has none.
    #[must_use]
    pub fn foot_or_name(&self) -> &str {
        self.foot.as_deref().unwrap_or(&self.name)
    }

    /// Name of the foot in tables and plots: that of the recording, then its own if it has one.
    #[must_use]
    pub fn title(&self) -> String {
        match &self.foot {
            Some(foot) => format!("{} {foot}", self.name),
            None => self.name.clone(),
        }
    }

    /// Names by which settings of single feet apply: [`Self::foot_or_name`], and for the only foot read from a bag each
    /// part of its topic.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let address = self.address.as_deref().filter(|_| self.foot.is_none());
        let parts = address.into_iter().flat_map(|address| address.split('/'));
        let parts = parts.filter(|part| !part.is_empty());
        [self.foot_or_name()].into_iter().chain(parts).collect()
    }

    /// The same with `foot`, another name of a foot that has none in its file.
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

/// Source of the time of a sample.
#[derive(Clone, Debug)]
pub(super) enum Timing {
    /// Stored time since the first sample.
    Stored,
    /// Computed from the sample's index and the sample rate.
    Steady,
    /// Time of the file's clock; samples whose flag is false are left out.
    Clock { kept: Vec<bool> },
    /// Other times of the file's clock, µs; samples without one are left out.
    Smoothed { times_us: Vec<Option<i64>> },
}

/// Iterator over the samples from a spool, with their times and corrected.
struct TimedSamples<'a> {
    samples: SpooledRows<'a, RecordedSample>,
    timing: &'a Timing,
    correction: Correction,
    /// Time of the file's clock at the first sample, µs.
    start_us: i64,
    sample_rate: f32,
    /// Index of the next sample.
    index: usize,
}

impl<'a> TimedSamples<'a> {
    /// Starts at the first sample; `clock` is that of [`Stored::clock_of_samples`].
    fn new(
        spool: &'a mut Spool,
        timing: &'a Timing,
        correction: Correction,
        clock: (i64, f32),
    ) -> io::Result<Self> {
        let (start_us, sample_rate) = clock;
        Ok(Self { samples: spool.rows()?, timing, correction, start_us, sample_rate, index: 0 })
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
            match self.timing {
                Timing::Stored => {}
                Timing::Steady => *timestamp = steady_time(index, self.sample_rate),
                Timing::Clock { kept } => {
                    if kept.get(index) == Some(&false) {
                        continue;
                    }
                    let clock_us = timestamp.as_micros().cast_signed();
                    *timestamp = Timestamp::from_micros(clock_us.abs_diff(self.start_us));
                }
                Timing::Smoothed { times_us } => {
                    let Some(clock_us) = times_us.get(index).copied().flatten() else {
                        continue;
                    };
                    *timestamp = Timestamp::from_micros(clock_us.abs_diff(self.start_us));
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
    /// Time of the file's clock at the first sample, µs, and samples per second.
    clock: (i64, f32),
}

/// Estimate that the foot sent, and that was recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedEstimate {
    /// The newest sample at that time, with the time of the estimate. Its label is that of a sample of this time, its
    /// load at most 100 ms old.
    pub sample: RecordedSample,
    /// Age of that sample, µs, if no earlier estimate had it.
    pub new_age_us: Option<u64>,
    /// Whether the foot sent the estimate as valid, whatever its flags, which may be older.
    pub is_valid: bool,
    /// The estimate; numbers that were not recorded with it are NaN.
    pub estimate: ContactEstimate,
    /// The same with the newest orientation of the foot, at most 25 ms old, and its acceleration, as far as known.
    pub moved: ContactEstimate,
}

/// Age up to which a load with its own stream is valid, µs: half of the shortest stance of a walking robot. It must
/// arrive at 10 Hz or more.
pub(super) const OLDEST_LOAD_US: u64 = 100_000;

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
                    (self.samples.start_us.saturating_add(since_us), sample)
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
        let moved = ContactEstimate {
            orientation: contact.orientation,
            linear_acceleration: LinearAcceleration(contact.acceleration),
            ..estimate
        };
        Ok(RecordedEstimate { sample, new_age_us, is_valid: contact.is_valid, estimate, moved })
    }
}

impl Iterator for RecordedEstimates<'_> {
    type Item = io::Result<RecordedEstimate>;

    fn next(&mut self) -> Option<Self::Item> {
        let contact = self.contacts.next()?;
        Some(contact.and_then(|contact| self.estimate(contact)))
    }
}
