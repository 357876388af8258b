//! `footfall demo`: estimates a simulated walk, without input files.

use std::fs;
use std::path::PathBuf;

use clap::Args;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams};
use live::robot::walk;

use crate::error::Error;
use crate::files::{OutputError, write_file};
use crate::report::{Outputs, write_outputs};
use crate::targets;

/// Default directory of the results.
pub const DIRECTORY: &str = "footfall-demo";

/// File name of the foot's CAN log.
pub const CAN_LOG: &str = "can.log";

/// The recording of what the foot sends on the serial line.
pub const UART: &str = "uart.bin";

/// Arguments of `footfall demo`.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Where samples.csv, plot.svg, can.log and uart.bin go; made where it does not exist
    #[arg(long, value_name = "DIR", default_value = DIRECTORY)]
    pub out: PathBuf,
    /// Seed of the sensor's noise and the foot's slips: the same seed, the same walk
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
    /// Simulates a walk, estimates it, and writes the samples, the picture and the output of the foot.
    pub(super) fn run(&self) -> Result<(), Error> {
        let directory = &self.out;
        targets::check_can_be_directory(directory)?;
        let plan = Plan::demo(self.seed);
        let simulation = gait::simulate(&plan, &SensorParams::LSM6DSOX, self.seed);
        let sent = walk::walk(&simulation)?;

        fs::create_dir_all(directory).map_err(|source| OutputError::Unwritable {
            file: directory.display().to_string(),
            source,
        })?;
        let (can, uart) = (directory.join(CAN_LOG), directory.join(UART));
        write_file(&can, |to| to.write_all(sent.can_log().as_bytes()))?;
        write_file(&uart, |to| to.write_all(&sent.uart))?;
        let outputs = Outputs {
            samples: directory.join("samples.csv"),
            plot: directory.join("plot.svg"),
            others: vec![can, uart],
        };
        write_outputs(&outputs, &simulation.recording, &sent.estimates)
    }
}
