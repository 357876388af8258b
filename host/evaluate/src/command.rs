//! The command line.

use std::io;
use std::path::PathBuf;

use clap::Parser;
use footfall::files::{OutputError, STANDARD, write_file};
use footfall::report::print_text;
use footfall::targets::{self, Target};

use crate::error::Error;
use crate::report::{cells::Style, full_tables, histogram, odometry_tables, reliability};
use crate::{Evaluation, Odometry, sets};

/// Default folder of datasets.
const DATASETS: &str = "../shared/datasets";

/// Scores this estimator and the methods of others on all recordings that have labels, and on simulated walks
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = sets::needed())]
pub struct EvaluateArguments {
    /// The folder with pce/, lcd/, pyshoe/ and robots/ in it, and pyshoe-positions/ for --odometry
    #[arg(long, value_name = "DIR", env = "FOOTFALL_DATASETS", default_value = DATASETS)]
    pub datasets: PathBuf,
    /// Print the tables in Markdown
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Print everything as one JSON object
    #[arg(long)]
    pub json: bool,
    /// Track the shoe with zero-velocity measurements of each detector instead, and print the errors
    #[arg(long, conflicts_with_all = ["json", "histogram", "reliability"])]
    pub odometry: bool,
    /// Draw the distribution of |P - label|, of this estimator and of fuzzy c-means
    #[arg(long, value_name = "OUT.svg")]
    pub histogram: Option<PathBuf>,
    /// Draw how often P comes true
    #[arg(long, value_name = "OUT.svg")]
    pub reliability: Option<PathBuf>,
}

impl EvaluateArguments {
    /// Runs the evaluation and writes the requested output.
    ///
    /// # Errors
    /// A recording is missing or cannot be scored, or a result cannot be written.
    pub fn run(&self) -> Result<(), Error> {
        let pictures = [&self.histogram, &self.reliability];
        let pictures: Vec<_> = pictures
            .into_iter()
            .flatten()
            .map(|path| Target::Picture(path))
            .collect();
        targets::check(&[], &pictures)?;
        let style = match self.markdown {
            true => Style::Markdown,
            false => Style::Text,
        };
        let text = if self.odometry {
            odometry_tables(&Odometry::run(&self.datasets)?, style)
        } else {
            let evaluation = Evaluation::run(&self.datasets)?;
            if let Some(path) = &self.histogram {
                write_file(path, |to| to.write_all(histogram(&evaluation)?.as_bytes()))?;
            }
            if let Some(path) = &self.reliability {
                write_file(path, |to| {
                    to.write_all(reliability(&evaluation)?.as_bytes())
                })?;
            }
            match self.json {
                true => json(&evaluation).map_err(unprinted)?,
                false => full_tables(&evaluation, style),
            }
        };
        print_text(&text).map_err(unprinted)
    }
}

fn json(evaluation: &Evaluation) -> io::Result<String> {
    Ok(serde_json::to_string_pretty(evaluation)? + "\n")
}

fn unprinted(source: io::Error) -> Error {
    Error::Output(OutputError::Unwritable {
        file: STANDARD.to_owned(),
        source,
    })
}
