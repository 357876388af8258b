//! Results of a command on standard output, as text or as JSON.
//!
//! Each JSON object names its layout under `schema`, except objects keyed by setting, and lists. The number at the end
//! of the name is increased when a field is removed or changes its meaning; adding a field is compatible.
//! `docs/reference/formats.md` describes the objects.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;

use calibration::learnt::LearntFoot;
use calibration::sensor::SensorCalibration;
use replay::summary::{Summaries, WithInputs};
use serde::Serialize;

use crate::files::to_stdout;

/// Format of the summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SummaryStyle {
    /// A few lines of text.
    #[default]
    Text,
    /// One JSON object with the program version and the id of its schema, as the only output on stdout.
    Json,
    /// None: standard output holds the table.
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

/// A report that can be printed as JSON.
pub trait Described: Serialize {
    /// Name of its layout.
    const SCHEMA: &'static str;
}

impl Described for Summaries {
    const SCHEMA: &'static str = "urn:footfall:replay:1";
}

impl Described for WithInputs<LearntFoot> {
    const SCHEMA: &'static str = "urn:footfall:calibrate:1";
}

impl Described for WithInputs<SensorCalibration> {
    const SCHEMA: &'static str = "urn:footfall:calibrate-rests:1";
}

impl Described for feet::decode::Report {
    const SCHEMA: &'static str = "urn:footfall:decode:1";
}

/// An object as it is printed.
#[derive(Debug, Serialize)]
pub struct Document<'a, R> {
    schema: &'static str,
    /// The version of the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<&'static str>,
    #[serde(flatten)]
    report: &'a R,
}

impl<'a, R: Described> Document<'a, R> {
    /// Wraps a report for printing.
    pub const fn of(report: &'a R) -> Self {
        Self { schema: R::SCHEMA, version: Some(env!("CARGO_PKG_VERSION")), report }
    }

    /// Wraps the state of a foot for printing. The version of the program is left out, because it would be repeated in
    /// every line, and could be mistaken for the version of the foot.
    pub const fn line(report: &'a R) -> Self {
        Self { version: None, ..Self::of(report) }
    }
}
