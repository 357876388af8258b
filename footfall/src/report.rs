//! What a command hands over in the end: tables, picture, summary.

use std::io::{self, Write};
use std::path::PathBuf;

use estimator_core::Params;

use crate::error::Error;
use crate::output::{write_estimates, write_file, write_samples};
use crate::plot;
use crate::recording::Recording;
use crate::replay::replay;
use crate::summary::Summary;

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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Where the table of samples with their estimates goes.
    pub samples: Option<PathBuf>,
    /// Where the table of estimates goes.
    pub estimates: Option<PathBuf>,
    /// Where the picture goes.
    pub plot: Option<PathBuf>,
    /// How the summary is printed.
    pub summary: SummaryStyle,
}

/// Runs the estimator over a recording, writes the files asked for and prints the summary.
/// `start_us` is what the recording's clock says at timestamp 0, µs.
///
/// # Errors
/// The parameters are not valid, a file cannot be written, or stdout cannot.
pub fn replay_into(
    outputs: &Outputs,
    recording: &Recording,
    start_us: i64,
    params: &Params,
) -> Result<(), Error> {
    let estimates = replay(recording, params)?;
    if let Some(path) = &outputs.samples {
        write_file(path, |to| write_samples(&recording.samples, &estimates, to))?;
    }
    if let Some(path) = &outputs.estimates {
        write_file(path, |to| write_estimates(&estimates, start_us, to))?;
    }
    if let Some(path) = &outputs.plot {
        write_file(path, |to| {
            to.write_all(plot::svg_at(start_us, recording, &estimates)?.as_bytes())
        })?;
    }
    print(&Summary::of(recording, &estimates), outputs).map_err(Error::Print)
}

fn print(summary: &Summary, outputs: &Outputs) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match outputs.summary {
        SummaryStyle::Json => {
            serde_json::to_writer_pretty(&mut stdout, summary)?;
            writeln!(stdout)?;
        }
        SummaryStyle::Text => {
            writeln!(stdout, "{summary}")?;
            let files = [&outputs.samples, &outputs.estimates, &outputs.plot];
            for path in files.into_iter().flatten() {
                writeln!(stdout, "written  {}", path.display())?;
            }
        }
    }
    stdout.flush()
}
