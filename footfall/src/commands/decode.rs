//! `footfall decode`: what a foot has sent, back to rows and a report.

use std::path::PathBuf;

use clap::Args;
use wire::NodeId;

use crate::decode::{self, row::write_rows};
use crate::error::Error;
use crate::files::write_file;
use crate::report::{SummaryStyle, print, warn};
use crate::targets::{self, Target};

/// What `footfall decode` takes.
#[derive(Debug, Args)]
pub struct DecodeArguments {
    /// The log or recording; which of the two it is, its contents tell
    pub input: PathBuf,
    /// On CAN, a node that is a foot beside those of the ids 0x11 to 0x16; may be repeated
    #[arg(long = "node", value_name = "ID", value_parser = parse_node)]
    pub nodes: Vec<NodeId>,
    /// Write the rows, one per contact frame
    #[arg(long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl DecodeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let table: Vec<_> = self.output.iter().map(|path| Target::Table(path)).collect();
        targets::check(std::slice::from_ref(&self.input), &table)?;
        let decoded = decode::read(&self.input, &self.nodes)?;
        decoded.notices.iter().for_each(warn);
        if let Some(path) = &self.output {
            write_file(path, |to| write_rows(&decoded.rows, to))?;
        }
        let style = if self.json {
            SummaryStyle::Json
        } else {
            SummaryStyle::Text
        };
        print(&decoded.report, style, &self.output).map_err(Error::Print)
    }
}

/// A node id, decimal or with 0x hexadecimal.
fn parse_node(text: &str) -> Result<NodeId, &'static str> {
    let id = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16),
        None => text.parse(),
    };
    id.ok()
        .and_then(NodeId::new)
        .ok_or("write a node id, 1 to 127 or 0x01 to 0x7F")
}
