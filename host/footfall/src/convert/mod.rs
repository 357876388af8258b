//! Conversion of a recording to another format, for `footfall convert`.
//!
//! The output holds the inputs of the estimator: SI units in the frame of the foot, f32, times in µs on the
//! recording's clock, with load, validity and label. Estimates from the output are therefore bit-identical to those
//! from the source.

#[cfg(feature = "bags")]
mod bag;

use std::io::{self, Write};
use std::path::Path;

use crate::ros::FootTopics;
use crate::ros::samples::{LAST_US, clock_shift_us};
use clap::ValueEnum;
use recordings::analysis::replay::span::Span;
use recordings::input::Stored;
use recordings::output::{write_recording_header, write_recording_row};
#[cfg(feature = "parquet")]
use recordings::parquet_samples::ParquetSamples;
use recordings::samples::recording::RecordedSample;

use crate::feature::Feature;
use crate::files::STANDARD;

/// Output formats of a conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ConvertFormat {
    /// A table: .csv
    Csv,
    /// The same columns, typed: .parquet
    Parquet,
    /// A bag of ROS 2: .mcap
    Mcap,
}

impl ConvertFormat {
    /// Accepted file extensions, for messages.
    pub const ENDINGS: &'static str = "csv, .parquet or .mcap";

    /// Returns the format for a file of this name; standard output gets a table.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        if path == Path::new(STANDARD) {
            return Some(Self::Csv);
        }
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let forms = [(".csv", Self::Csv), (".parquet", Self::Parquet), (".mcap", Self::Mcap)];
        let found = forms.into_iter().find(|(ending, _)| name.ends_with(ending));
        found.map(|(_, form)| form)
    }

    /// Returns the feature that writes the format; `None` if it needs none.
    #[must_use]
    pub const fn feature(self) -> Option<Feature> {
        match self {
            Self::Csv => None,
            Self::Parquet => Some(Feature::Parquet),
            Self::Mcap => Some(Feature::Bags),
        }
    }

    /// Returns whether the format holds several feet.
    #[must_use]
    pub const fn holds_several(self) -> bool {
        matches!(self, Self::Mcap)
    }
}

/// A foot to be converted.
pub struct ConvertedFoot {
    /// Name of the foot.
    pub name: String,
    /// Recording of the foot.
    pub stored: Stored,
}

/// Returns the samples of a foot within a span.
///
/// # Errors
/// The temporary file with the samples cannot be read.
pub fn samples(
    stored: &mut Stored,
    span: Span,
) -> io::Result<impl Iterator<Item = io::Result<RecordedSample>> + '_> {
    let is_in = move |sample: &io::Result<RecordedSample>| match sample {
        Ok(sample) => span.contains(sample.imu.timestamp),
        Err(_) => true,
    };
    Ok(stored.samples()?.filter(is_in))
}

/// Returns the item of least time that a stream has next, and the index of the stream; the first of several.
///
/// # Errors
/// The first error of `next`, which returns a time and its item.
#[cfg(feature = "bags")]
pub(crate) fn earliest<S, K: Ord, T>(
    streams: &mut [S],
    mut next: impl FnMut(&mut S) -> io::Result<Option<(K, T)>>,
) -> io::Result<Option<(T, usize)>> {
    let mut first: Option<(K, T, usize)> = None;
    for (index, stream) in streams.iter_mut().enumerate() {
        if let Some((time, item)) = next(stream)?
            && first.as_ref().is_none_or(|(before, ..)| time < *before)
        {
            first = Some((time, item, index));
        }
    }
    Ok(first.map(|(_, item, index)| (item, index)))
}

/// Writes the table of a foot.
///
/// # Errors
/// Errors of the writer and of the temporary file.
pub fn write_table(
    form: ConvertFormat,
    stored: &mut Stored,
    span: Span,
    to: &mut dyn Write,
) -> io::Result<()> {
    let start_us = stored.about.start_us;
    match form {
        #[cfg(feature = "parquet")]
        ConvertFormat::Parquet => {
            let mut table = ParquetSamples::new(to)?;
            for sample in samples(stored, span)? {
                table.add(&sample?, start_us)?;
            }
            table.finish()?;
        }
        _ => {
            write_recording_header(to)?;
            for sample in samples(stored, span)? {
                write_recording_row(&sample?, start_us, to)?;
            }
        }
    }
    Ok(())
}

/// A bag as target of a conversion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bag {
    /// Topics of each foot.
    pub topics: Vec<FootTopics>,
    /// Whether the feet have loads: all or none.
    pub has_loads: bool,
    /// Offset of the bag's clock from the recording's, µs.
    pub shift_us: i64,
}

impl Bag {
    /// Creates a bag for these feet; `None` if a bag cannot hold their times.
    #[must_use]
    pub fn new(feet: &[ConvertedFoot], has_loads: bool) -> Option<Self> {
        let abouts = feet.iter().map(|foot| &foot.stored.about);
        let starts = abouts.clone().map(|about| about.start_us);
        let shift_us = clock_shift_us(starts.min().unwrap_or_default());
        let ends_us = abouts.map(|about| about.start_us.saturating_add_unsigned(about.duration_us));
        let ends_us = ends_us.max().unwrap_or_default();
        let is_in_time = ends_us.saturating_add(shift_us) <= LAST_US;
        is_in_time.then(|| Self {
            topics: feet.iter().map(|foot| FootTopics::of(&foot.name)).collect(),
            has_loads,
            shift_us,
        })
    }
}
