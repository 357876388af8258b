//! `footfall evaluate`: this estimator and the methods of others on all recordings with labels.

use std::path::PathBuf;

use clap::Args;
use scoring::{Evaluation, Odometry};

use crate::error::Error;
use crate::evaluate::{
    DATASETS, full_tables, histogram, odometry_tables, reliability, table::Style,
};
use crate::files::write_file;
use crate::report::{print_json, print_text};
use crate::targets::{self, Target};

/// What `footfall evaluate` takes.
#[derive(Debug, Args)]
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
    pub(super) fn run(&self) -> Result<(), Error> {
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
        if self.odometry {
            let odometry = Odometry::run(&self.datasets)?;
            return print_text(&odometry_tables(&odometry, style)).map_err(Error::Print);
        }
        let evaluation = Evaluation::run(&self.datasets)?;
        if let Some(path) = &self.histogram {
            write_file(path, |to| to.write_all(histogram(&evaluation)?.as_bytes()))?;
        }
        if let Some(path) = &self.reliability {
            write_file(path, |to| {
                to.write_all(reliability(&evaluation)?.as_bytes())
            })?;
        }
        if self.json {
            print_json(&evaluation)
        } else {
            print_text(&full_tables(&evaluation, style))
        }
        .map_err(Error::Print)
    }
}
