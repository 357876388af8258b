//! Writing the messages of all feet in order of time: MCAP, and the directory of a rosbag2.

use std::io::{self, Write};
use std::iter::Peekable;
use std::path::Path;

use analysis::replay::span::Span;
use analysis::whole_file::WholeFolder;
use estimator_core::Timestamp;
use mcap::write::NoSeek;
use recordings::recording::RecordedSample;
use ros::{McapFile, Rosbag2File, SampleMessages};

use super::{Bag, ConvertedFoot, samples};
use crate::mcap_recording::io_error;

impl Bag {
    /// Writes the messages of all feet in order of time.
    fn write(
        &self,
        feet: &mut [ConvertedFoot],
        span: Span,
        mut put: impl FnMut(&ros::Published) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut streams = Vec::new();
        for foot in feet {
            let offset_us = foot.stored.about.start_us + self.shift_us;
            let messages = SampleMessages::new(&foot.name);
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

    /// Writes the bag as MCAP.
    ///
    /// # Errors
    /// Errors of the writer and of the temporary files.
    pub fn write_mcap(
        &self,
        feet: &mut [ConvertedFoot],
        span: Span,
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let mut bag = McapFile::new(NoSeek::new(to)).map_err(io_error)?;
        self.write(feet, span, |published| {
            bag.write(published).map_err(io_error)
        })?;
        bag.finish().map_err(io_error)
    }

    /// Writes the bag as the directory of a rosbag2.
    ///
    /// # Errors
    /// Errors of the directory and of the temporary files.
    pub fn write_rosbag2(
        &self,
        feet: &mut [ConvertedFoot],
        span: Span,
        path: &Path,
    ) -> io::Result<()> {
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

/// Samples of a foot to be written to a bag.
struct Stream<I: Iterator<Item = io::Result<RecordedSample>>> {
    /// Offset added to the timestamps, µs.
    offset_us: i64,
    messages: SampleMessages,
    samples: Peekable<I>,
}

impl<I: Iterator<Item = io::Result<RecordedSample>>> Stream<I> {
    /// Returns the acquisition time of the next sample, on the clock of the bag.
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
