//! Copy of a bag with the contacts of its feet, as the output of `footfall replay`.

use std::path::Path;
#[cfg(feature = "bags")]
use std::path::PathBuf;

use crate::ros::Compat;
use clap::Args;

use super::published::compat_parser;
#[cfg(feature = "bags")]
use crate::bag_copy::{self, LowStates, OfAllFeet};
use crate::commands::headings::OUTPUT;
#[cfg(feature = "bags")]
use crate::error::Error;
use crate::files::OutputError;
#[cfg(feature = "bags")]
use crate::replay_output::CopiedFoot;

/// Messages of all feet in a copy of a bag.
#[derive(Clone, Debug, Default, Args)]
pub struct CopiedArguments {
    /// In a copy of a bag, write the decisions of all four feet in messages of other programs, too; several are
    /// separated by commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',', value_parser = compat_parser(), help_heading = OUTPUT)]
    pub compat: Vec<Compat>,
    /// In a copy of a bag, write the messages of a Unitree robot on this topic again, on /footfall/lowstate, with 100
    /// as the `foot_force` of a foot that stands and 0 of others
    #[arg(long, value_name = "TOPIC", help_heading = OUTPUT)]
    pub lowstate: Option<String>,
    /// Factor of the loads that are the forces instead of decisions.
    #[arg(
        long,
        value_name = "FACTOR",
        requires = "lowstate",
        allow_negative_numbers = true,
        value_parser = parse_scale,
        help = "With --lowstate, the forces are the loads times this factor, rounded",
        help_heading = OUTPUT
    )]
    pub lowstate_scale: Option<f64>,
}

impl CopiedArguments {
    /// Checks that the options apply: there is a copy, or none of them is given.
    pub(crate) fn check(&self, bag: Option<&Path>) -> Result<(), OutputError> {
        let option = match (&self.compat[..], &self.lowstate) {
            ([], None) => return Ok(()),
            (_, Some(_)) => "--lowstate",
            (_, None) => "--compat",
        };
        if bag.is_none() {
            return Err(OutputError::NoCopy(option));
        }
        if self.lowstate.is_some() && self.compat.contains(&Compat::Unitree) {
            return Err(OutputError::LowStateTwice);
        }
        Ok(())
    }

    /// Copies the only bag of `inputs` with the contacts and events of feet.
    #[cfg(feature = "bags")]
    pub(crate) fn copy(
        &self,
        inputs: &[PathBuf],
        to: &Path,
        feet: &mut [CopiedFoot],
        again: bool,
    ) -> Result<(), Error> {
        let of_all_feet = OfAllFeet {
            compats: self.compat.clone(),
            low_states: self
                .lowstate
                .clone()
                .map(|topic| LowStates { topic, scale: self.lowstate_scale }),
        };
        for input in inputs {
            // Parts that end early were reported when the samples were read.
            bag_copy::write(input, feet, &of_all_feet, again, to)?;
        }
        Ok(())
    }
}

/// Parses a factor of loads.
fn parse_scale(text: &str) -> Result<f64, &'static str> {
    let scale = text.parse().ok();
    scale
        .filter(|scale: &f64| scale.is_finite() && *scale != 0.0)
        .ok_or("write a number other than 0")
}
