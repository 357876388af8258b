//! Writing the samples of all feet to MCAP, in order of time.

use std::io::{self, Write};
use std::iter::Peekable;

use crate::ros::{McapFile, SampleMessages};
use estimator_core::Timestamp;
use mcap::write::NoSeek;
use recordings::analysis::replay::span::Span;
use recordings::samples::recording::RecordedSample;

use super::{Bag, ConvertedFoot, earliest, samples};
use crate::mcap_recording::io_error;

impl Bag {
    /// Writes the messages of all feet in order of time.
    ///
    /// # Errors
    /// Errors of the writer and of the temporary files.
    pub fn write(
        &self,
        feet: &mut [ConvertedFoot],
        span: Span,
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let mut bag = McapFile::new(NoSeek::new(to)).map_err(io_error)?;
        let mut streams = Vec::new();
        for foot in feet {
            let offset_us = foot.stored.about.start_us + self.shift_us;
            streams.push(Stream {
                offset_us,
                messages: SampleMessages::new(&foot.name, self.has_loads),
                samples: samples(&mut foot.stored, span)?.peekable(),
            });
        }
        while let Some((at, index)) = earliest(&mut streams, |stream| {
            let next = stream.next_at()?;
            Ok(next.map(|at| (at, at)))
        })? {
            let stream = &mut streams[index];
            if let Some(sample) = stream.samples.next() {
                let mut messages = stream.messages.messages(&sample?, at).into_iter();
                messages.try_for_each(|published| bag.write(&published).map_err(io_error))?;
            }
        }
        bag.finish().map_err(io_error)
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
        let next = self.samples.peek().and_then(|next| next.as_ref().ok());
        Ok(next.map(|sample| {
            let micros = sample.imu.timestamp.as_micros();
            Timestamp::from_micros(micros.saturating_add_signed(self.offset_us))
        }))
    }
}
