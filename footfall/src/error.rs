//! Everything that can end a command, as one clear sentence each.

use std::io;

#[cfg(feature = "parquet")]
use analysis::batch::{BatchError, sources::NoSource};
use analysis::calibrate::CalibrationError;
use analysis::config::{ConfigError, Refusal};
use analysis::replay::foot::ReplayError;
use decode::DecodeError;
use decode::feet::NamedTwice;
use estimator_core::ParamsError;
use recordings::input::{ContainerError, InputError};
use thiserror::Error;

use crate::feature::{Feature, NotBuilt};
use crate::files::OutputError;

/// Why a command could not do what it was asked.
#[derive(Debug, Error)]
pub enum Error {
    /// This program does not have what it takes.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
    /// The recording cannot be used.
    #[error(transparent)]
    Input(InputError),
    /// What was to be decoded cannot be.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// Names of feet contradict each other.
    #[error(transparent)]
    Names(#[from] NamedTwice),
    /// The configuration file cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// There is no such key in a configuration file.
    #[error("there is no key {key}: {hint}")]
    UnknownKey {
        /// As it was asked for.
        key: String,
        /// What may have been meant.
        hint: String,
    },
    /// There is no such fault, flag or refusal.
    #[error("nothing is called {wanted:?}; footfall explain lists all faults, flags and refusals")]
    NothingToExplain {
        /// As it was asked for.
        wanted: String,
    },
    /// The parameters are not valid, in the estimator's words.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The parameters are not valid, in the words of the option or key that sets them.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The recordings do not show what a calibration needs.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A recording is not plausible, and it should be.
    #[error("{file}: --strict does not let {count} of the above pass")]
    Implausible {
        /// The recording, as it was named.
        file: String,
        /// How many things are not.
        count: usize,
    },
    /// The part of the recording that is asked for is over before it begins.
    #[error("--to {to} does not come after --from {from}")]
    EmptySpan {
        /// Its start, s.
        from: f64,
        /// Its end, s.
        to: f64,
    },
    /// The part of the recording that is asked for begins after its end.
    #[error("{file}: --from {from} is beyond its end: it lasts {duration:.3} s")]
    BeyondTheEnd {
        /// The recording, as it was named.
        file: String,
        /// The start that was asked for, s since the first sample.
        from: f64,
        /// From its first sample to its last, s.
        duration: f64,
    },
    /// The part of the recording that is asked for lies in a gap of it.
    #[error("{file}: there is no sample from --from to --to")]
    NothingInSpan {
        /// The recording, as it was named.
        file: String,
    },
    /// The samples or rows cannot be kept while they are worked on.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The results of a batch cannot be written, or its temporary files.
    #[cfg(feature = "parquet")]
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A source of a batch is not there.
    #[cfg(feature = "parquet")]
    #[error(transparent)]
    NoSource(#[from] NoSource),
    /// Recordings of a batch have failed, as was said.
    #[error("{failed} of {recordings} recordings failed")]
    Failed {
        /// How many.
        failed: usize,
        /// Of how many.
        recordings: usize,
    },
    /// A result could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A foot could not be asked or set.
    #[error(transparent)]
    Foot(#[from] crate::commands::foot::FootError),
    /// Nothing can be published in ROS 2.
    #[cfg(feature = "ros2")]
    #[error("ROS 2: {0}")]
    Ros2(#[from] ros_node::NodeError),
    /// The source has nothing to give.
    #[error(transparent)]
    Source(#[from] live::LinkError),
    /// Several feet would become a table, which has one.
    #[error(
        "{file} has several feet, and a table has one: {}; choose one with --topic, or write .mcap",
        feet.join(", ")
    )]
    OneFootOnly {
        /// The recording, as it was named.
        file: String,
        /// Their names.
        feet: Vec<String>,
    },
    /// Nothing can be served to viewers.
    #[cfg(feature = "foxglove")]
    #[error(transparent)]
    View(#[from] crate::view::ViewError),
    /// The summary could not be printed.
    #[error("the summary cannot be printed: {0}")]
    Print(#[source] io::Error),
}

/// A format that this program does not read takes one of its features.
impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        if let InputError::Container(ContainerError::NotBuilt { file, feature, .. }) = &error
            && let Some(feature) = Feature::named(feature)
        {
            Self::NotBuilt(feature.missing_for(file))
        } else {
            Self::Input(error)
        }
    }
}
