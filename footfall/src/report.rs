//! What a command writes in the end: tables, picture, summary.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;

use estimator_core::ContactEstimate;
use recordings::output::{write_estimates, write_samples};
use recordings::recording::Recording;
use serde::Serialize;

use crate::error::Error;
use crate::files::write_file;
use crate::plot;
use crate::summary::{InputReport, Summary};

/// How the summary is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SummaryStyle {
    /// A few lines for a person.
    #[default]
    Text,
    /// One JSON object, and nothing else, on stdout.
    Json,
}

/// What a replay is to leave behind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs {
    /// Where the table of samples with their estimates goes.
    pub samples: Option<PathBuf>,
    /// Where the table of estimates goes.
    pub estimates: Option<PathBuf>,
    /// Where the picture goes.
    pub plot: Option<PathBuf>,
    /// What has been written already and is to be named too.
    pub others: Vec<PathBuf>,
    /// What there is to say about the file that was read, where there was one.
    pub input: Option<InputReport>,
    /// How the summary is printed.
    pub summary: SummaryStyle,
}

/// Writes the files asked for of a recording and its estimates, one per sample, and prints the
/// summary. `start_us` is what the recording's clock says at timestamp 0, µs.
///
/// # Errors
/// A file cannot be written, or stdout cannot.
pub fn write_outputs(
    outputs: &Outputs,
    recording: &Recording,
    start_us: i64,
    estimates: &[ContactEstimate],
) -> Result<(), Error> {
    if let Some(path) = &outputs.samples {
        write_file(path, |to| write_samples(&recording.samples, estimates, to))?;
    }
    if let Some(path) = &outputs.estimates {
        write_file(path, |to| write_estimates(estimates, start_us, to))?;
    }
    if let Some(path) = &outputs.plot {
        write_file(path, |to| {
            to.write_all(plot::svg_at(start_us, recording, estimates)?.as_bytes())
        })?;
    }
    let files = [&outputs.samples, &outputs.estimates, &outputs.plot];
    let files = files.into_iter().flatten().chain(&outputs.others);
    let summary = Summary {
        input: outputs.input.clone(),
        ..Summary::of(recording, estimates)
    };
    print(&summary, outputs.summary, files).map_err(Error::Print)
}

/// Prints a summary, and for a person which files were written.
///
/// # Errors
/// Stdout cannot be written.
pub fn print<'a>(
    summary: &(impl Serialize + Display),
    style: SummaryStyle,
    written: impl IntoIterator<Item = &'a PathBuf>,
) -> io::Result<()> {
    match style {
        SummaryStyle::Json => print_json(summary),
        SummaryStyle::Text => {
            let mut stdout = io::stdout().lock();
            writeln!(stdout, "{summary}")?;
            for path in written {
                writeln!(stdout, "written  {}", path.display())?;
            }
            stdout.flush()
        }
    }
}

/// Writes a message to stderr: an error, or what was left out or reinterpreted. Where stderr is
/// closed, the command goes on.
pub fn warn(message: impl Display) {
    let _ = writeln!(io::stderr(), "footfall: {message}");
}

/// Prints one JSON object.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_json(what: &impl Serialize) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    serde_json::to_writer_pretty(&mut stdout, what)?;
    writeln!(stdout)?;
    stdout.flush()
}

/// Prints a text that ends its last line.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_text(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}
