//! `footfall decode`: decodes the output of a foot to rows, events, a picture and a report.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use feet::decode::{self, ContactRow, DecodeError, Feet, FileOutcome};
use recordings::analysis::replay::estimates::Layout;
use recordings::input::recording_name;

use super::feet::FeetArguments;
use crate::decoded::{DecodedFeet, DecodedTable};
use crate::error::Error;
use crate::files::{OutputError, STANDARD, write_file};
use crate::messages::{aside, warn};
use crate::replay::write_shown;
use crate::report::{SummaryStyle, print};
use crate::targets::{self, Drawing, Target};

/// Arguments of `footfall decode`.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// The log of candump (with -l, or as it prints) or the bytes of a serial line, or - for standard
    /// input; may be compressed with gzip or zstd. Other logs are converted with python-can
    pub input: PathBuf,
    /// Which nodes are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// Write the rows, one per contact frame, as CSV or Parquet; - writes them to standard output, and the
    /// report to standard error
    #[arg(long, value_name = "OUT.csv|parquet")]
    pub output: Option<PathBuf>,
    /// Write the events, as replay does: touch-downs, lift-offs, starts and ends of slips and of stances that
    /// are never stable
    #[arg(long, value_name = "OUT.csv")]
    pub events: Option<PathBuf>,
    /// Draw the contacts, as replay does: as .html a page of all feet, as .svg a figure of each
    #[arg(long, value_name = "OUT.html|svg")]
    pub plot: Option<PathBuf>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl DecodeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let feet = self.feet.feet()?;
        self.check_targets()?;
        let mut decoded = DecodedFeet::default();
        let mut outcome = match &self.output {
            None => decode::read(&self.input, &feet, &mut |row| {
                self.collect(&mut decoded, &row)
            })?,
            Some(path) => match self.write_rows(path, &feet, &mut decoded)? {
                Some(outcome) => outcome,
                None => return Ok(()),
            },
        };
        let mut written: Vec<PathBuf> = self.output.iter().cloned().collect();
        written.extend(self.write_feet(decoded, &mut outcome.notices)?);
        let FileOutcome { report, notices } = &outcome;
        notices.iter().for_each(warn);
        if self.fills_stdout() {
            aside(report);
            return Ok(());
        }
        print(report, SummaryStyle::of(self.json), &written).map_err(Error::Print)
    }

    /// Checks that all results can be written before anything is decoded.
    fn check_targets(&self) -> Result<(), OutputError> {
        let table = self.output.as_deref().map(Target::Estimates);
        let events = self.events.as_deref().map(Target::Events);
        let picture = self.plot.as_deref().map(Target::Drawing);
        let all: Vec<_> = [table, events, picture].into_iter().flatten().collect();
        targets::check(std::slice::from_ref(&self.input), &all)?;
        if self.json && self.fills_stdout() {
            return Err(OutputError::StdoutTwice);
        }
        Ok(())
    }

    /// Returns whether a result other than the report goes to standard output.
    fn fills_stdout(&self) -> bool {
        let results = [&self.output, &self.events, &self.plot];
        let mut paths = results.into_iter().flatten();
        paths.any(|path| path == Path::new(STANDARD))
    }

    /// Returns whether there are events or plots of the feet.
    const fn has_feet(&self) -> bool {
        self.events.is_some() || self.plot.is_some()
    }

    /// Keeps a row for events and plots, if there are any.
    fn collect(&self, decoded: &mut DecodedFeet, row: &ContactRow) -> io::Result<()> {
        match self.has_feet() {
            true => decoded.add(row),
            false => Ok(()),
        }
    }

    /// Writes the table; `None` if its reader has closed it and there is no other result.
    fn write_rows(
        &self,
        path: &Path,
        feet: &Feet,
        decoded: &mut DecodedFeet,
    ) -> Result<Option<FileOutcome>, Error> {
        let mut result = None;
        write_file(path, |to| {
            let mut table = Some(DecodedTable::new(Layout::of(path), to)?);
            let read = decode::read(&self.input, feet, &mut |row| {
                self.collect(decoded, &row)?;
                match table.as_mut().map_or(Ok(()), |table| table.add(&row)) {
                    // A closed table does not end the other results.
                    Err(error) if self.has_feet() && error.kind() == io::ErrorKind::BrokenPipe => {
                        table = None;
                        Ok(())
                    }
                    added => added,
                }
            });
            result = Some(read.map_err(|error| match error {
                // Errors of the writer concern the output file.
                DecodeError::Rows(error) => error,
                error => io::Error::other(Error::from(error)),
            })?);
            table.map_or(Ok(()), DecodedTable::finish)
        })?;
        Ok(result)
    }

    /// Writes events and pictures of the feet, and returns the files.
    fn write_feet(
        &self,
        decoded: DecodedFeet,
        notices: &mut Vec<String>,
    ) -> Result<Vec<PathBuf>, Error> {
        if !self.has_feet() {
            return Ok(Vec::new());
        }
        let several = decoded.are_several();
        let drawing = self.plot.as_deref().map(Drawing::of);
        let name = recording_name(&self.input);
        let (mut feet, left_out) = decoded.finish(&name, self.events.is_some(), drawing)?;
        notices.extend(left_out);
        let (events, plot) = (self.events.as_deref(), self.plot.as_deref());
        Ok(write_shown(events, plot, &mut feet, several)?)
    }
}
