//! `footfall demo`: a simulated walk through the estimator, with no files needed.

use std::fs;
use std::path::Path;

use firmware::imu::default_params;
use wire::Settings;

use crate::error::Error;
use crate::gait::{self, Plan, SensorParams};
use crate::output::{OutputError, write_file};
use crate::replay::replay;
use crate::report::{Outputs, SummaryStyle, hand_over};
use crate::targets;
use crate::transmit::transmit;

/// Where the results go where nothing else is said.
pub const DIRECTORY: &str = "footfall-demo";

/// What the foot sends on CAN.
pub const CAN_LOG: &str = "can.log";

/// What the foot sends on the serial line.
pub const UART: &str = "uart.bin";

/// The walk that is shown where nothing else is said.
pub const SEED: u64 = 1;

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
    hand_over(&outputs, &walk.recording, 0, &estimates)
}
