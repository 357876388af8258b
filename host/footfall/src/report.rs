//! Results of a command: tables, picture, summary.

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

/// Format of the summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SummaryStyle {
    /// A few lines of text.
    #[default]
    Text,
    /// One JSON object as the only output on stdout.
    Json,
    /// None: stdout holds the table.
    Silent,
}

/// Output files of the demo.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs {
    /// Table of samples with their estimates.
    pub samples: PathBuf,
    /// Picture of the walk.
    pub plot: PathBuf,
    /// Files already written, to be listed too.
    pub others: Vec<PathBuf>,
}

/// Writes the table and the picture of a recording with one estimate per sample, and prints the summary.
///
/// # Errors
/// A file or stdout cannot be written.
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

/// Prints one JSON object with the program version and the id of its schema. Non-finite numbers become `null`.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_json(what: &impl Described) -> io::Result<()> {
    unless_closed(to_stdout(|stdout| {
        serde_json::to_writer_pretty(&mut *stdout, &Document::of(what))?;
        writeln!(stdout)
    }))
}

/// Prints a text that includes its final newline.
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
