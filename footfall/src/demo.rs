//! `footfall demo`: a simulated walk through the estimator, with no files needed.

use std::fs;
use std::path::Path;

use firmware::imu::default_params;

use crate::error::Error;
use crate::gait::{self, Plan, SensorParams};
use crate::output::OutputError;
use crate::report::{Outputs, SummaryStyle, replay_into};
use crate::targets;

/// Where the results go where nothing else is said.
pub const DIRECTORY: &str = "footfall-demo";

/// The walk that is shown where nothing else is said.
pub const SEED: u64 = 1;

/// Walks, estimates, and writes `samples.csv` and `plot.svg` into `directory`, which is made
/// where it does not exist. The summary goes to stdout.
///
/// # Errors
/// The files cannot be written, or stdout cannot.
pub fn run(directory: &Path, seed: u64) -> Result<(), Error> {
    targets::check_can_be_directory(directory)?;
    let recording = gait::record(&Plan::demo(seed), &SensorParams::LSM6DSOX, seed);
    fs::create_dir_all(directory).map_err(|source| OutputError::Unwritable {
        file: directory.display().to_string(),
        source,
    })?;
    let outputs = Outputs {
        samples: Some(directory.join("samples.csv")),
        estimates: None,
        plot: Some(directory.join("plot.svg")),
        summary: SummaryStyle::Text,
    };
    replay_into(&outputs, &recording, 0, &default_params())
}
