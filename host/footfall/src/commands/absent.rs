//! Commands that are not built; each reports the feature it needs.

use std::ffi::OsString;

use clap::Args;

use crate::error::Error;
use crate::feature::Feature;

macro_rules! absent {
    ($name:ident, $command:literal, $feature:expr) => {
        #[doc = concat!("Whatever `", $command, "` takes.")]
        #[derive(Debug, Args)]
        #[command(disable_help_flag = true)]
        pub struct $name {
            /// Taken as it is.
            #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
            pub all: Vec<OsString>,
        }

        impl $name {
            pub(super) fn run(&self) -> Result<(), Error> {
                Err($feature.missing_for($command).into())
            }
        }
    };
}

#[cfg(not(feature = "parquet"))]
absent!(BatchArguments, "footfall batch", Feature::Parquet);
#[cfg(not(feature = "ros2"))]
absent!(Ros2Arguments, "footfall ros2", Feature::Ros2);
