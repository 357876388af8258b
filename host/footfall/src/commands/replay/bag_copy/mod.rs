//! Copy of bags with the contacts of their feet, for `footfall replay --output OUT.mcap`: its options, what is checked
//! before the estimate, and the feet that [`merger`] writes into it.

#[cfg(feature = "bags")]
mod merger;

use std::path::{Path, PathBuf};

use clap::Args;
use estimator_core::any::AnyParams;
use replay::Span;
use replay::events::ContactEvent;
use stored::Stored;

use super::Output;
use crate::commands::options::{OUTPUT, compat_parser, parse_force};
use crate::files::{OutputError, STANDARD, directory_of};
use crate::ros::Compat;
use crate::ros::compat::{Body, MixedBodies, WRENCH_FORCE};

#[cfg(feature = "bags")]
pub(super) use merger::BagCopy;

/// Messages of all feet that a copy of bags contains in addition.
#[derive(Clone, Debug, Default, Args)]
pub struct CopyArguments {
    /// In a copy of a bag, also write the decisions of all feet in messages of other programs, separated by
    /// commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',', value_parser = compat_parser(), help_heading = OUTPUT)]
    pub compat: Vec<Compat>,
    /// Force of a foot that stands, N, in messages of --compat wrench
    #[arg(long, value_name = "NEWTONS", default_value_t = WRENCH_FORCE, value_parser = parse_force, help_heading = OUTPUT)]
    pub wrench_force: f64,
    /// In a copy of a bag, repeat the messages of a Unitree robot on this topic as /footfall/lowstate, with a
    /// `foot_force` of 100 for each standing foot and 0 for the others
    #[arg(long, value_name = "TOPIC", help_heading = OUTPUT)]
    pub lowstate: Option<String>,
    /// Factor of the loads that are the forces instead of decisions.
    #[arg(
        long,
        value_name = "FACTOR",
        requires = "lowstate",
        allow_negative_numbers = true,
        value_parser = parse_scale,
        help = "With --lowstate, write the loads times this factor, rounded, as forces",
        help_heading = OUTPUT
    )]
    pub lowstate_scale: Option<f64>,
}

impl CopyArguments {
    /// Checks that the bags `inputs` can be copied, if the output is a copy. Otherwise checks that none of these options
    /// is given.
    pub(super) fn check_output(
        &self,
        inputs: &[PathBuf],
        output: Option<&Output>,
    ) -> Result<(), OutputError> {
        match (output, self.option()) {
            (Some(Output::Copy(copy)), _) => check_inputs(inputs, copy),
            (Some(Output::Table(_)) | None, Some(option)) => Err(OutputError::NoCopy(option)),
            (Some(Output::Table(_)) | None, None) => Ok(()),
        }
    }

    /// Checks that `--lowstate` suits a robot with this body, and that no other option writes its topic.
    pub(super) fn check_lowstate(&self, body: Body) -> Result<(), OutputError> {
        if self.lowstate.is_some() {
            if body == Body::Biped {
                return Err(MixedBodies("--lowstate").into());
            }
            if self.compat.contains(&Compat::Unitree) {
                return Err(OutputError::LowStateTwice);
            }
        }
        Ok(())
    }

    /// Returns the option that requests messages of all feet, if any.
    fn option(&self) -> Option<&'static str> {
        match (&self.lowstate, &self.compat[..]) {
            (Some(_), _) => Some("--lowstate"),
            (None, [_, ..]) => Some("--compat"),
            (None, []) => None,
        }
    }
}

/// Foot whose contacts go into a copy of its bag.
#[cfg_attr(not(feature = "bags"), expect(dead_code, reason = "only a copy of a bag reads it"))]
pub(super) struct CopiedFoot {
    /// Bag of the foot.
    pub(super) file: String,
    /// Name of the foot, in the topics of its contacts.
    pub(super) name: String,
    /// Place of the foot in messages of all feet, if its names have one.
    pub(super) place: Option<usize>,
    /// Samples of the foot.
    pub(super) stored: Stored,
    /// Parameters of its estimate.
    pub(super) params: AnyParams,
    /// Part of the recording whose contacts are written.
    pub(super) span: Span,
    /// Events in that part.
    pub(super) events: Vec<ContactEvent>,
}

/// Checks that each input can be read a second time, for the copy, and does not contain the copy.
fn check_inputs(inputs: &[PathBuf], copy: &Path) -> Result<(), OutputError> {
    let folder = directory_of(copy).unwrap_or(Path::new(".")).canonicalize().ok();
    for input in inputs {
        let is_pipe = input.exists() && !input.is_file() && !input.is_dir();
        if is_pipe || input == Path::new(STANDARD) {
            return Err(OutputError::ReadTwice(copy.display().to_string()));
        }
        // A rosbag2 folder.
        if let (Some(folder), Ok(input)) = (&folder, input.canonicalize())
            && input.is_dir()
            && folder.starts_with(&input)
        {
            return Err(OutputError::OverInput(copy.display().to_string()));
        }
    }
    Ok(())
}

/// Parses a factor of loads.
fn parse_scale(text: &str) -> Result<f64, &'static str> {
    let scale = text.parse().ok();
    scale
        .filter(|scale: &f64| scale.is_finite() && *scale != 0.0)
        .ok_or("write a number other than 0")
}
