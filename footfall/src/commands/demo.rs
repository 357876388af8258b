//! `footfall demo`: a simulated walk through the estimator, with no files needed.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use firmware::imu::default_params;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams};
use recordings::replay::replay;
use wire::Settings;

use crate::error::Error;
use crate::files::{OutputError, write_file};
use crate::report::{Outputs, SummaryStyle, write_outputs};
use crate::targets;
use crate::transmit::transmit;

/// Where the results go where nothing else is said.
pub const DIRECTORY: &str = "footfall-demo";

/// What the foot sends on CAN.
pub const CAN_LOG: &str = "can.log";

/// What the foot sends on the serial line.
pub const UART: &str = "uart.bin";

/// What `footfall demo` takes.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Where samples.csv, plot.svg, can.log and uart.bin go; made where it does not exist
    #[arg(long, value_name = "DIR", default_value = DIRECTORY)]
    pub out: PathBuf,
    /// What the sensor's noise and the foot's slips are drawn from: the same seed, the same walk
    #[arg(long, default_value_t = DEMO_SEED)]
    pub seed: u64,
}

impl Default for DemoArguments {
    fn default() -> Self {
        Self {
            out: DIRECTORY.into(),
            seed: DEMO_SEED,
        }
    }
}

impl DemoArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        run(&self.out, self.seed)
    }
}

/// Walks, estimates, and writes into `directory`, which is made where it does not exist:
/// `samples.csv` and `plot.svg`, and what the foot sends of it, `can.log` and `uart.bin`. The
/// summary goes to stdout.
///
/// # Errors
/// The files cannot be written, or stdout cannot.
pub fn run(directory: &Path, seed: u64) -> Result<(), Error> {
    targets::check_can_be_directory(directory)?;
    let walk = gait::simulate(&Plan::demo(seed), &SensorParams::LSM6DSOX, seed);
    let estimates = replay(&walk.recording, &default_params())?;
    let sent = transmit(&Settings::default(), &estimates, &walk.temperatures, &[]);

    fs::create_dir_all(directory).map_err(|source| OutputError::Unwritable {
        file: directory.display().to_string(),
        source,
    })?;
    let (can, uart) = (directory.join(CAN_LOG), directory.join(UART));
    write_file(&can, |to| to.write_all(sent.can_log().as_bytes()))?;
    write_file(&uart, |to| to.write_all(&sent.uart))?;
    let outputs = Outputs {
        samples: Some(directory.join("samples.csv")),
        estimates: None,
        plot: Some(directory.join("plot.svg")),
        others: vec![can, uart],
        summary: SummaryStyle::Text,
    };
    write_outputs(&outputs, &walk.recording, 0, &estimates)
}
