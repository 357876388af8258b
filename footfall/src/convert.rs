//! A recording in another format: what `footfall convert` writes.
//!
//! What is written is what the estimator takes: SI units in the frame of the foot, f32, times in µs on the
//! recording's clock, with load, validity and label. So an estimate from it has the bits of one from the
//! recording that was read.

use std::io::{self, Write};
use std::iter::Peekable;
use std::path::Path;

use analysis::replay::span::Span;
use analysis::whole_file::WholeFolder;
use clap::ValueEnum;
use estimator_core::Timestamp;
use flate2::Compression;
use flate2::write::GzEncoder;
use mcap::write::NoSeek;
use recordings::input::Stored;
use recordings::output::{write_recording_header, write_recording_row};
use recordings::parquet_samples::ParquetSamples;
use recordings::recording::RecordedSample;
use ros::samples::{LAST_US, clock_shift_us};
use ros::{McapFile, Rosbag2File, Samples, Topics};

use crate::files::{STANDARD, io_error};

/// What a recording can become.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Form {
    /// A table: .csv
    Csv,
    /// A table, compressed with gzip: .csv.gz
    CsvGz,
    /// The same columns, typed: .parquet
    Parquet,
    /// A bag of ROS 2: .mcap
    Mcap,
    /// A bag of ROS 2: a folder
    Rosbag2,
}

impl Form {
    /// What the names of files end in.
    pub const ENDINGS: &'static str =
        "csv, .csv.gz, .parquet or .mcap; or add --as, such as --as rosbag2 for a folder";

    /// Of a file of this name; standard output gets a table.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        if path == Path::new(STANDARD) {
            return Some(Self::Csv);
        }
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let forms = [
            (".csv", Self::Csv),
            (".csv.gz", Self::CsvGz),
            (".parquet", Self::Parquet),
            (".mcap", Self::Mcap),
        ];
        let found = forms.into_iter().find(|(ending, _)| name.ends_with(ending));
        found.map(|(_, form)| form)
    }

    /// Whether it holds several feet.
    #[must_use]
    pub const fn holds_several(self) -> bool {
        matches!(self, Self::Mcap | Self::Rosbag2)
    }
}

/// A foot that is converted.
pub struct Foot {
    /// What it is called.
    pub name: String,
    /// Its recording.
    pub stored: Stored,
}

/// The samples of a foot that are in a span.
fn samples(
    stored: &mut Stored,
    span: Span,
) -> io::Result<impl Iterator<Item = io::Result<RecordedSample>> + '_> {
    let is_in = move |sample: &io::Result<RecordedSample>| match sample {
        Ok(sample) => span.contains(sample.imu.timestamp),
        Err(_) => true,
    };
    Ok(stored.samples()?.filter(is_in))
}

/// Shows all samples that are converted.
///
/// # Errors
/// The temporary file that holds them cannot be read.
pub fn each(
    stored: &mut Stored,
    span: Span,
    mut see: impl FnMut(&RecordedSample),
) -> io::Result<()> {
    for sample in samples(stored, span)? {
        see(&sample?);
    }
    Ok(())
}

/// Writes a table of a foot.
///
/// # Errors
/// What the writer and the temporary file report.
pub fn write_table(
    form: Form,
    stored: &mut Stored,
    span: Span,
    mut to: &mut dyn Write,
) -> io::Result<()> {
    let start_us = stored.about.start_us;
    match form {
        Form::CsvGz => {
            let mut packed = GzEncoder::new(to, Compression::default());
            write_table(Form::Csv, stored, span, &mut packed)?;
            packed.finish()?;
        }
        Form::Parquet => {
            let mut table = ParquetSamples::new(&mut to)?;
            for sample in samples(stored, span)? {
                table.add(&sample?, start_us)?;
            }
            table.finish()?;
        }
        Form::Csv | Form::Mcap | Form::Rosbag2 => {
            write_recording_header(to)?;
            for sample in samples(stored, span)? {
                write_recording_row(&sample?, start_us, to)?;
            }
        }
    }
    Ok(())
}

/// A bag as it is converted to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bag {
    /// The topics of each foot.
    pub topics: Vec<Topics>,
    /// Whether feet have loads: all or none.
    pub has_loads: bool,
    /// What its clock is ahead of the recording's, µs.
    pub shift_us: i64,
}

impl Bag {
    /// For these feet; `None` where a bag has no such times.
    #[must_use]
    pub fn new(feet: &[Foot], has_loads: bool) -> Option<Self> {
        let abouts = feet.iter().map(|foot| &foot.stored.about);
        let starts = abouts.clone().map(|about| about.start_us);
        let shift_us = clock_shift_us(starts.min().unwrap_or_default());
        let last = |about: &recordings::input::About| {
            let duration_us = i64::try_from(about.duration_us).unwrap_or(i64::MAX);
            about.start_us.saturating_add(duration_us)
        };
        let ends_us = abouts.map(last).max().unwrap_or_default();
        let is_in_time = ends_us.saturating_add(shift_us) <= LAST_US;
        is_in_time.then(|| Self {
            topics: feet.iter().map(|foot| Topics::of(&foot.name)).collect(),
            has_loads,
            shift_us,
        })
    }

    /// Writes the messages of all feet by their times.
    fn write(
        &self,
        feet: &mut [Foot],
        span: Span,
        mut put: impl FnMut(&ros::Published) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut streams = Vec::new();
        for foot in feet {
            let offset_us = foot.stored.about.start_us + self.shift_us;
            let messages = Samples::new(&foot.name);
            streams.push(Stream {
                offset_us,
                messages: if self.has_loads {
                    messages.with_load()
                } else {
                    messages
                },
                samples: samples(&mut foot.stored, span)?.peekable(),
            });
        }
        loop {
            let mut first: Option<(Timestamp, usize)> = None;
            for (index, stream) in streams.iter_mut().enumerate() {
                if let Some(at) = stream.next_at()?
                    && first.is_none_or(|(before, _)| at.as_micros() < before.as_micros())
                {
                    first = Some((at, index));
                }
            }
            let Some((at, index)) = first else {
                return Ok(());
            };
            let stream = &mut streams[index];
            if let Some(sample) = stream.samples.next() {
                for published in stream.messages.messages(&sample?, at) {
                    put(&published)?;
                }
            }
        }
    }

    /// Writes it as MCAP.
    ///
    /// # Errors
    /// What the writer and the temporary files report.
    pub fn write_mcap(&self, feet: &mut [Foot], span: Span, to: &mut dyn Write) -> io::Result<()> {
        let mut bag = McapFile::new(NoSeek::new(to)).map_err(io_error)?;
        self.write(feet, span, |published| {
            bag.write(published).map_err(io_error)
        })?;
        bag.finish().map_err(io_error)
    }

    /// Writes it as the folder of a rosbag2.
    ///
    /// # Errors
    /// What the folder and the temporary files report.
    pub fn write_rosbag2(&self, feet: &mut [Foot], span: Span, path: &Path) -> io::Result<()> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let folder = WholeFolder::create(path)?;
        let mut bag = Rosbag2File::new(folder.path(), &name).map_err(io::Error::other)?;
        self.write(feet, span, |published| {
            bag.write(published).map_err(io::Error::other)
        })?;
        bag.finish().map_err(io::Error::other)?;
        folder.finish()
    }
}

/// The samples of a foot on their way to a bag.
struct Stream<I: Iterator<Item = io::Result<RecordedSample>>> {
    /// What is to be added to their timestamps, µs.
    offset_us: i64,
    messages: Samples,
    samples: Peekable<I>,
}

impl<I: Iterator<Item = io::Result<RecordedSample>>> Stream<I> {
    /// When the next sample was acquired, on the clock of the bag.
    fn next_at(&mut self) -> io::Result<Option<Timestamp>> {
        if let Some(Err(error)) = self.samples.next_if(Result::is_err) {
            return Err(error);
        }
        let micros = |sample: &RecordedSample| sample.imu.timestamp.as_micros();
        let next = self.samples.peek().and_then(|next| next.as_ref().ok());
        Ok(next.map(|sample| {
            Timestamp::from_micros(micros(sample).saturating_add_signed(self.offset_us))
        }))
    }
}
