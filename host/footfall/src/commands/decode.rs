//! `footfall decode`: decodes the output of a foot to rows and a report.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use feet::decode::row::{HEADER, write_row};
use feet::decode::{self, DecodeError, FileOutcome, KnownFeet};

use super::options::{FeetArguments, OUTPUT, OverwriteArguments};
use crate::error::Error;
use crate::files::{self, OutputError, STANDARD, Target, write_file};
use crate::messages::{aside, warn};
use crate::report::{SummaryStyle, print};
use crate::words::with_hint;

/// Arguments of `footfall decode`.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// Log of candump (with -l, or as it prints) or bytes of a serial line; - is standard input. It may be
    /// compressed with gzip or zstd. Convert other logs with python-can
    pub input: PathBuf,
    /// Nodes that are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// Write the rows, one per contact frame, as CSV; - writes them to standard output, and the report to
    /// standard error
    #[arg(long, short, value_name = "OUT.csv", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Whether existing files are replaced.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
    /// Print the report as one JSON object
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,
}

impl DecodeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        // Contradicting names are an error, even if a name belongs to a line that is not decoded.
        self.feet.feet()?;
        let mut named = self.feet.clone();
        if self.input != Path::new(STANDARD) {
            let line = self.input.display().to_string();
            named.take_unused(&[&line]).into_iter().for_each(warn);
        }
        let feet = named.feet()?;
        let table = self.output.as_deref().map(Target::Rows);
        let existing = self.overwrite.existing();
        files::check(std::slice::from_ref(&self.input), table.as_slice(), existing)?;
        let fills_stdout = self.output.as_deref() == Some(Path::new(STANDARD));
        if self.json && fills_stdout {
            return Err(OutputError::StdoutTwice.into());
        }
        let outcome = match &self.output {
            None => decode::read(&self.input, &feet, &mut |_| Ok(()))?,
            Some(path) => match self.write_rows(path, &feet)? {
                Some(outcome) => outcome,
                None => return Ok(()),
            },
        };
        let FileOutcome { file, report, notices } = &outcome;
        for notice in notices {
            warn(with_hint(notice.sentence(file), notice.hint()));
        }
        if fills_stdout {
            aside(report);
            return Ok(());
        }
        print(report, SummaryStyle::of(self.json), &self.output).map_err(Error::Print)
    }

    /// Writes the rows to a file; `None` if standard output is closed.
    fn write_rows(&self, path: &Path, feet: &KnownFeet) -> Result<Option<FileOutcome>, Error> {
        let mut result = None;
        write_file(path, self.overwrite.existing(), |to| {
            // The header is written with the first row, so that nothing is written if the file cannot be read.
            let mut is_begun = false;
            let read = decode::read(&self.input, feet, &mut |row| {
                if !std::mem::replace(&mut is_begun, true) {
                    writeln!(to, "{HEADER}")?;
                }
                write_row(&row, to)
            });
            result = Some(read.map_err(|error| match error {
                // Errors of the writer concern the output file.
                DecodeError::Rows(error) => error,
                error => io::Error::other(Error::from(error)),
            })?);
            if is_begun { Ok(()) } else { writeln!(to, "{HEADER}") }
        })?;
        Ok(result)
    }
}
