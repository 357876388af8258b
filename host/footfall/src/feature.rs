//! Optional parts of the program: interfaces to third-party programs, which most users do not need and which take long
//! to build.

use std::fmt;
use std::sync::LazyLock;

use thiserror::Error;

samples::named! {
    /// A part that is built with `--features NAME`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Feature {
        /// Reads bags of ROS 2 (MCAP and rosbag2) and of ROS 1, and writes MCAP.
        Bags = "bags",
        /// Shows streaming feet in Foxglove and `PlotJuggler`.
        Foxglove = "foxglove",
        /// Reads and writes Parquet.
        Parquet = "parquet",
        /// Publishes streaming feet as a ROS 2 node.
        Ros2 = "ros2",
    }
}

impl Feature {
    /// Returns whether this program is built with the feature.
    #[must_use]
    pub const fn is_built(self) -> bool {
        match self {
            Self::Bags => cfg!(feature = "bags"),
            Self::Foxglove => cfg!(feature = "foxglove"),
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Ros2 => cfg!(feature = "ros2"),
        }
    }

    /// Checks that this program is built with the feature, which `what` requires.
    ///
    /// # Errors
    /// The feature is not built.
    pub fn needed_for(self, what: impl fmt::Display) -> Result<(), NotBuilt> {
        if self.is_built() { Ok(()) } else { Err(self.missing_for(what)) }
    }

    /// Returns the error that `what` requires this feature.
    #[must_use]
    pub fn missing_for(self, what: impl fmt::Display) -> NotBuilt {
        let features = names(|other| other == self || other.is_built()).join(",");
        NotBuilt { what: what.to_string(), feature: self, features }
    }
}

/// A required feature is not built.
#[derive(Debug, Error)]
#[error(
    "{what} needs the feature {feature}, and this footfall is built without it; \
     install it in its clone with: cargo install --locked --path host/footfall --features {features}"
)]
pub struct NotBuilt {
    what: String,
    feature: Feature,
    /// The feature with the built ones. An installation replaces the program, so with the feature alone it would take
    /// the others away.
    features: String,
}

/// Names of some features.
fn names(is_named: impl Fn(Feature) -> bool) -> Vec<&'static str> {
    Feature::ALL.into_iter().filter(|feature| is_named(*feature)).map(Feature::name).collect()
}

/// Returns the version with the list of built features.
pub fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let names = match &names(Feature::is_built)[..] {
            [] => "none".to_owned(),
            names => names.join(", "),
        };
        format!("{} (features: {names})", env!("CARGO_PKG_VERSION"))
    });
    &VERSION
}
