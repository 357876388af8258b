//! The parts of the program that are built only where they are asked for: ways to programs of others,
//! each of which takes longer to build than all the rest.

use std::fmt;
use std::sync::LazyLock;

use thiserror::Error;

/// A part that is built with `--features` and its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Bags of ROS 2, MCAP and rosbag2, are read and written.
    Bags,
    /// Foxglove and `PlotJuggler` show feet that stream.
    Foxglove,
    /// Parquet is read and written, and folders of recordings become tables of it.
    Parquet,
    /// A replay is drawn in pixels.
    Png,
    /// Feet that stream are a node of ROS 2.
    Ros2,
    /// The monitor draws a picture of the feet in the terminal.
    Screen,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Bags,
        Self::Foxglove,
        Self::Parquet,
        Self::Png,
        Self::Ros2,
        Self::Screen,
    ];

    /// The feature of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|feature| feature.name() == name)
    }

    /// Its name in `--features`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bags => "bags",
            Self::Foxglove => "foxglove",
            Self::Parquet => "parquet",
            Self::Png => "png",
            Self::Ros2 => "ros2",
            Self::Screen => "screen",
        }
    }

    /// Whether this program has it.
    #[must_use]
    pub const fn is_built(self) -> bool {
        match self {
            Self::Bags => cfg!(feature = "bags"),
            Self::Foxglove => cfg!(feature = "foxglove"),
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Png => cfg!(feature = "png"),
            Self::Ros2 => cfg!(feature = "ros2"),
            Self::Screen => cfg!(feature = "screen"),
        }
    }

    /// Makes sure that this program has it; `what` cannot be done otherwise.
    ///
    /// # Errors
    /// It does not.
    pub fn needed_for(self, what: impl fmt::Display) -> Result<(), NotBuilt> {
        if self.is_built() {
            Ok(())
        } else {
            Err(self.missing_for(what))
        }
    }

    /// Why `what` cannot be done by a program that does not have it.
    #[must_use]
    pub fn missing_for(self, what: impl fmt::Display) -> NotBuilt {
        NotBuilt {
            what: what.to_string(),
            feature: self,
        }
    }
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What was asked for takes a part that this program does not have.
#[derive(Debug, Error)]
#[error(
    "{what} needs the feature {feature}, and this footfall is built without it; \
     build it with: cargo run --release --features {feature}"
)]
pub struct NotBuilt {
    what: String,
    feature: Feature,
}

/// The version, with the features that are built.
pub fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let built = Feature::ALL
            .into_iter()
            .filter(|feature| feature.is_built());
        let names: Vec<_> = built.map(Feature::name).collect();
        let names = match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        };
        format!("{} (features: {names})", env!("CARGO_PKG_VERSION"))
    });
    &VERSION
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_built_is_named_with_the_command_that_builds_it() {
        for feature in Feature::ALL {
            let name = feature.name();
            assert_eq!(version().contains(name), feature.is_built(), "{name}");
            match feature.needed_for("walk.mcap") {
                Ok(()) => assert!(feature.is_built(), "{name}"),
                Err(error) => assert!(
                    !feature.is_built()
                        && error.to_string().starts_with("walk.mcap needs")
                        && error.to_string().ends_with(&format!("--features {name}")),
                    "{error}"
                ),
            }
        }
    }
}
