//! `footfall decode`: decodes the output of a foot to rows and a report.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use decode::row::{write_header, write_row};
use decode::{self, DecodeError, Feet, Outcome};

use super::feet::FeetArguments;
use crate::error::Error;
use crate::files::{OutputError, STANDARD, write_file};
use crate::messages;
use crate::report::{SummaryStyle, print, warn};
use crate::targets::{self, Target};

/// Arguments of `footfall decode`.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// The log or recording, or - for standard input; its contents tell which of these it is: candump
    /// (with -l, or as it prints), Vector ASC, python-can's CSV, or the bytes of the serial line; may
    /// be compressed with gzip or zstd
    pub input: PathBuf,
    /// Which nodes are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// Write the rows, one per contact frame; - writes them to standard output, and the report to
    /// standard error
    #[arg(long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl DecodeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let feet = self.feet.feet()?;
        let Some(path) = self.output.as_deref() else {
            let outcome = decode::read(&self.input, &feet, &mut |_| Ok(()))?;
            return self.report(&outcome);
        };
        targets::check(std::slice::from_ref(&self.input), &[Target::Table(path)])?;
        let to_stdout = path == Path::new(STANDARD);
        if to_stdout && self.json {
            return Err(OutputError::StdoutTwice.into());
        }
        let (mut outcome, mut refused) = (None, None);
        let written = write_file(path, |to| match self.rows_to(&feet, to) {
            Ok(decoded) => {
                outcome = Some(decoded);
                Ok(())
            }
            // Errors of the writer concern the output file.
            Err(DecodeError::Rows(error)) => Err(error),
            Err(error) => {
                refused = Some(error);
                Err(io::ErrorKind::InvalidData.into())
            }
        });
        if let Some(error) = refused {
            return Err(error.into());
        }
        match (written, outcome) {
            (Err(error), _) => Err(error.into()),
            (Ok(()), Some(Outcome { report, notices })) if to_stdout => {
                notices.iter().for_each(warn);
                messages::aside(&report);
                Ok(())
            }
            (Ok(()), outcome) => outcome.map_or(Ok(()), |outcome| self.report(&outcome)),
        }
    }

    fn rows_to(&self, feet: &Feet, to: &mut dyn Write) -> Result<Outcome, DecodeError> {
        let mut is_begun = false;
        let mut begin = |to: &mut dyn Write| {
            if is_begun {
                return Ok(());
            }
            is_begun = true;
            write_header(to)
        };
        let outcome = decode::read(&self.input, feet, &mut |row| {
            begin(to)?;
            write_row(&row, to)
        })?;
        begin(to).map_err(DecodeError::Rows)?;
        Ok(outcome)
    }

    fn report(&self, Outcome { report, notices }: &Outcome) -> Result<(), Error> {
        notices.iter().for_each(warn);
        let style = if self.json {
            SummaryStyle::Json
        } else {
            SummaryStyle::Text
        };
        print(report, style, &self.output).map_err(Error::Print)
    }
}
