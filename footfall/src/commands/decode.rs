//! `footfall decode`: what a foot has sent, back to rows and a report.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use decode::feet::{Name, NamedTwice};
use decode::row::{write_header, write_row};
use decode::{self, DecodeError, Feet, Outcome};
use wire::NodeId;

use crate::error::Error;
use crate::files::{OutputError, STANDARD, write_file};
use crate::messages;
use crate::report::{SummaryStyle, print, warn};
use crate::targets::{self, Target};

/// What `footfall decode` takes.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// The log or recording, or - for standard input; its contents tell which of these it is: candump
    /// (with -l, or as it prints), Vector ASC, python-can's CSV, or the bytes of the serial line; may
    /// be compressed with gzip or zstd
    pub input: PathBuf,
    /// On CAN, a node that is a foot beside those of the ids 0x11 to 0x16; may be repeated
    #[arg(long = "node", value_name = "ID", value_parser = parse_node)]
    pub nodes: Vec<NodeId>,
    /// Names of feet by node id, for the column foot, such as 1=FL,2=FR; these nodes are feet
    #[arg(long, value_name = "ID=NAME,...", value_delimiter = ',', value_parser = parse_name)]
    pub names: Vec<(NodeId, Name)>,
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
        let feet = self.feet()?;
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
            // What the writer says is about the file that is written.
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

    fn feet(&self) -> Result<Feet, NamedTwice> {
        let mut feet = Feet::default();
        self.nodes.iter().for_each(|node| feet.add(*node));
        feet.call(&self.names)?;
        Ok(feet)
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

/// A node id, decimal or with 0x hexadecimal.
pub(super) fn parse_node(text: &str) -> Result<NodeId, &'static str> {
    let id = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16),
        None => text.parse(),
    };
    id.ok()
        .and_then(NodeId::new)
        .ok_or("write a node id, 1 to 127 or 0x01 to 0x7F")
}

/// A node id and the name of its foot.
fn parse_name(text: &str) -> Result<(NodeId, Name), String> {
    let (id, name) = text
        .split_once('=')
        .ok_or("write a node id and a name, such as 1=FL")?;
    let name = Name::new(name).map_err(|error| error.to_string())?;
    Ok((parse_node(id)?, name))
}
