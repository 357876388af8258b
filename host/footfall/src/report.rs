//! Results of a command on standard output.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

use crate::files::to_stdout;
use crate::json::{Described, Document};

/// Format of the summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SummaryStyle {
    /// A few lines of text.
    #[default]
    Text,
    /// One JSON object with the program version and the id of its schema, as the only output on stdout.
    Json,
    /// None: stdout holds the table.
    Silent,
}

impl SummaryStyle {
    /// Returns the style of a command with the option `--json`.
    #[must_use]
    pub const fn of(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }
}

/// Prints a summary; as text, it is followed by the written files.
///
/// # Errors
/// Stdout cannot be written.
pub fn print<'a>(
    summary: &(impl Described + Display),
    style: SummaryStyle,
    written: impl IntoIterator<Item = &'a PathBuf>,
) -> io::Result<()> {
    match style {
        SummaryStyle::Silent => Ok(()),
        // Non-finite numbers become `null`.
        SummaryStyle::Json => to_stdout(|stdout| {
            serde_json::to_writer_pretty(&mut *stdout, &Document::of(summary))?;
            writeln!(stdout)
        }),
        SummaryStyle::Text => to_stdout(|stdout| {
            writeln!(stdout, "{summary}")?;
            for path in written {
                writeln!(stdout, "written  {}", path.display())?;
            }
            Ok(())
        }),
    }
}

/// Prints a text that includes its final newline.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_text(text: &str) -> io::Result<()> {
    to_stdout(|stdout| stdout.write_all(text.as_bytes()))
}
