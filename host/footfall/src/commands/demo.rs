//! `footfall demo`: estimates a simulated walk, without input files.

use std::path::PathBuf;

use clap::Args;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams};
use replay::summary::{Summaries, Summary};
use simulated_robot::walk;
use tables::output::write_samples;

use super::options::{OUTPUT, OverwriteArguments};
use crate::error::Error;
use crate::files::{OutputError, check_can_be_directory, create_directory, write_file};
use crate::plot;
use crate::report::{SummaryStyle, print};

/// Default directory of the results.
pub const DIRECTORY: &str = "footfall-demo";

/// Arguments of `footfall demo`.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Directory for samples.csv, plot.svg, can.log and uart.bin; created if it does not exist
    #[arg(long, short, value_name = "DIR", default_value = DIRECTORY, help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Whether existing files are replaced.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
    /// Seed of the sensor's noise and the foot's slips; the same seed gives the same walk
    #[arg(long, default_value_t = DEMO_SEED)]
    pub seed: u64,
}

impl Default for DemoArguments {
    fn default() -> Self {
        Self { output: DIRECTORY.into(), overwrite: OverwriteArguments::default(), seed: DEMO_SEED }
    }
}

impl DemoArguments {
    /// Simulates a walk, estimates it, and writes the samples, the picture and the output of the foot.
    pub(super) fn run(&self) -> Result<(), Error> {
        let directory = &self.output;
        let files =
            ["samples.csv", "plot.svg", "can.log", "uart.bin"].map(|name| directory.join(name));
        // An unusable directory is reported before the simulation, which takes some seconds.
        check_can_be_directory(directory)?;
        let existing = self.overwrite.existing();
        if let Some(file) = files.iter().find(|file| existing.check(file).is_err()) {
            return Err(OutputError::DemoExists(file.display().to_string()).into());
        }
        let plan = Plan::demo(self.seed);
        let simulation = gait::simulate(&plan, &SensorParams::LSM6DSOX, self.seed);
        let sent = walk::walk(&simulation)?;

        create_directory(directory)?;
        let (recording, estimates) = (&simulation.recording, &sent.estimates);
        let [samples, picture, can, uart] = &files;
        write_file(can, existing, |to| to.write_all(sent.can_log().as_bytes()))?;
        write_file(uart, existing, |to| to.write_all(&sent.uart))?;
        write_file(samples, existing, |to| write_samples(&recording.samples, estimates, to))?;
        write_file(picture, existing, |to| {
            to.write_all(plot::svg(recording, estimates)?.as_bytes())
        })?;
        let summary = Summaries { recordings: vec![Summary::of(recording, estimates)] };
        print(&summary, SummaryStyle::Text, &files).map_err(Error::Print)
    }
}
