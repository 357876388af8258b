//! Result of reading a file: a recording whose samples are in a [`Spool`].

use std::io;

use estimator_core::{Gravity, Timestamp};

use super::loaded::{Loaded, Repairs, steady_time};
use super::options::Units;
use crate::recording::{RecordedSample, Recording};
use crate::spool::{Samples, Spool};

/// Properties of a recording other than its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Name of the source, for titles and messages.
    pub name: String,
    /// Name of the foot, if the file has several or names it.
    pub foot: Option<String>,
    /// Number of samples.
    pub samples: usize,
    /// Duration from the first sample to the last, µs. The first is at time 0.
    pub duration_us: u64,
    /// Samples per second.
    pub sample_rate: f32,
    /// Whether the accelerations contain gravity.
    pub gravity: Gravity,
    /// Units in which the file was read, if different from those of its format.
    pub units: Units,
    /// Name and unit of the load signal, such as `vertical force (N)`.
    pub load_title: String,
    /// Time of the file's clock at the first sample, µs; 0 if the file has no clock. It may be negative, as before
    /// a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence for each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<String>,
    /// Rows that were left out or whose time was changed.
    pub repairs: Repairs,
}

impl About {
    /// Time from the first sample to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_us as f64 / 1.0e6
    }
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
}

/// A recording that has been read. Its memory does not grow with its length.
pub struct Stored {
    /// Properties of the recording.
    pub about: About,
    spool: Spool,
    timing: Timing,
}

impl Stored {
    pub(super) const fn new(about: About, spool: Spool, timing: Timing) -> Self {
        Self {
            about,
            spool,
            timing,
        }
    }

    /// Stores a recording that is in memory.
    pub(super) fn from_loaded(loaded: Loaded) -> io::Result<Self> {
        let recording = loaded.recording;
        let mut spool = Spool::default();
        for sample in &recording.samples {
            spool.push(sample)?;
        }
        let last = recording.samples.last();
        let about = About {
            foot: None,
            samples: recording.samples.len(),
            duration_us: last.map_or(0, |sample| sample.imu.timestamp.as_micros()),
            sample_rate: recording.sample_rate,
            gravity: recording.gravity,
            units: Units::default(),
            name: recording.name,
            load_title: recording.load_title,
            start_us: loaded.start_us,
            notices: loaded.notices,
            repairs: loaded.repairs,
        };
        Ok(Self::new(about, spool, Timing::Stored))
    }

    /// Returns all samples, from the first.
    ///
    /// # Errors
    /// The temporary file with the samples cannot be written or read.
    pub fn samples(&mut self) -> io::Result<impl Iterator<Item = io::Result<RecordedSample>> + '_> {
        Ok(Timed {
            samples: self.spool.samples()?,
            timing: &self.timing,
            start_us: self.about.start_us,
            sample_rate: self.about.sample_rate,
            index: 0,
        })
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

/// Iterator that adds the times to samples.
struct Timed<'a> {
    samples: Samples<'a>,
    timing: &'a Timing,
    start_us: i64,
    sample_rate: f32,
    /// Index of the next sample.
    index: usize,
}

impl Iterator for Timed<'_> {
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
            }
            return Some(Ok(sample));
        }
    }
}
