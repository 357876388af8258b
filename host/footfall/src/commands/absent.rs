//! The command `ros2` where it is not built: it reports the feature it needs.

use std::ffi::OsString;

use clap::Args;

use crate::error::Error;
use crate::feature::Feature;

/// Whatever `footfall ros2` takes.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Ros2Arguments {
    /// Taken as it is.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub all: Vec<OsString>,
}

impl Ros2Arguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        Err(Feature::Ros2.missing_for("footfall ros2").into())
    }
}
