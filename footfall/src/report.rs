//! What a command writes in the end: tables, picture, summary.

use std::fmt::Display;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use analysis::summary::{Summaries, Summary};
use estimator_core::ContactEstimate;
use recordings::output::write_samples;
use recordings::recording::Recording;

use crate::error::Error;
use crate::files::{unless_closed, write_file};
use crate::plot;
use crate::schema::{Described, Document};

pub use crate::messages::warn;

/// How the summary is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SummaryStyle {
    /// A few lines for a person.
    #[default]
    Text,
    /// One JSON object, and nothing else, on stdout.
    Json,
    /// Nothing: stdout has the table.
    Silent,
}

/// Where the demo's results go.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs {
    /// The table of samples with their estimates.
    pub samples: PathBuf,
    /// The picture.
    pub plot: PathBuf,
    /// What has been written already and is to be named too.
    pub others: Vec<PathBuf>,
}

/// Writes the table and the picture of a recording and its estimates, one per sample, and prints
/// the summary.
///
/// # Errors
/// A file cannot be written, or stdout cannot.
pub fn write_outputs(
    outputs: &Outputs,
    recording: &Recording,
    estimates: &[ContactEstimate],
) -> Result<(), Error> {
    let Outputs {
        samples,
        plot,
        others,
    } = outputs;
    write_file(samples, |to| {
        write_samples(&recording.samples, estimates, to)
    })?;
    write_file(plot, |to| {
        to.write_all(plot::svg(recording, estimates)?.as_bytes())
    })?;
    let files = [samples, plot].into_iter().chain(others);
    let summary = Summaries::new(vec![Summary::of(recording, estimates)]);
    print(&summary, SummaryStyle::Text, files).map_err(Error::Print)
}

/// Prints a summary, and for a person which files were written.
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
        SummaryStyle::Json => print_json(summary),
        SummaryStyle::Text => unless_closed(to_stdout(|stdout| {
            writeln!(stdout, "{summary}")?;
            for path in written {
                writeln!(stdout, "written  {}", path.display())?;
            }
            Ok(())
        })),
    }
}

/// Prints one JSON object, with the version of the program and what describes the object. A number
/// that is not finite is `null`.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_json(what: &impl Described) -> io::Result<()> {
    unless_closed(to_stdout(|stdout| {
        serde_json::to_writer_pretty(&mut *stdout, &Document::of(what))?;
        writeln!(stdout)
    }))
}

/// Prints a text that ends its last line.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_text(text: &str) -> io::Result<()> {
    unless_closed(to_stdout(|stdout| stdout.write_all(text.as_bytes())))
}

fn to_stdout(content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut stdout = BufWriter::new(io::stdout().lock());
    content(&mut stdout)?;
    stdout.flush()
}
