//! Errors that end a command, each reported as one sentence.

use std::io;

use estimator_core::ParamsError;
use feet::decode::DecodeError;
use feet::decode::feet::NamedTwice;
use feet::link::{LinkError, RecordingError};
use recordings::calibrate::CalibrationError;
use recordings::config::{ConfigError, NoSuchFoot, ParameterRefusal};
use recordings::input::{InputError, Problem};
use recordings::replay::ReplayError;
use thiserror::Error;

use crate::feature::{Feature, NotBuilt};
use crate::files::OutputError;
use crate::foot_error::{FootError, with_hint};
use crate::words::in_words;

/// Reason a command failed.
#[derive(Debug, Error)]
pub enum Error {
    /// A feature required by the command is not built.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
    /// The recording cannot be used.
    #[error("{}", in_words(.0))]
    Input(InputError),
    /// The input of a decoding cannot be used.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// Names of feet contradict each other.
    #[error(transparent)]
    Names(#[from] NamedTwice),
    /// The configuration file cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No fault, flag or refusal has this name.
    #[error(
        "nothing is called {0:?}; footfall explain lists all faults, flags, refusals, states and findings"
    )]
    NothingToExplain(String),
    /// The parameters are invalid; described by the estimator.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The parameters are invalid; described by the option or key that sets them.
    #[error("{}", in_words(.0))]
    Refused(#[from] ParameterRefusal),
    /// The recordings do not contain the data a calibration needs.
    #[error("{}", in_words(.0))]
    Calibration(#[from] CalibrationError),
    /// A recording is implausible and `--strict` is given.
    #[error("{file}: --strict does not let {count} of the above pass")]
    Implausible {
        /// Recording as given.
        file: String,
        /// Number of findings.
        count: usize,
    },
    /// The requested span ends before it begins.
    #[error("--to {to} does not come after --from {from}")]
    EmptySpan {
        /// Start of the span, s.
        from: f64,
        /// End of the span, s.
        to: f64,
    },
    /// The requested span begins after the end of the recording.
    #[error("{file}: --from {from} is beyond its end: it lasts {duration:.3} s")]
    BeyondTheEnd {
        /// Recording as given.
        file: String,
        /// Requested start, s since the first sample.
        from: f64,
        /// Duration from the first to the last sample, s.
        duration: f64,
    },
    /// The requested span lies in a gap of the recording.
    #[error("{0}: there is no sample from --from to --to")]
    NothingInSpan(String),
    /// The samples or rows cannot be stored temporarily.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(OutputError),
    /// A request to a foot failed.
    #[error(transparent)]
    Foot(#[from] FootError),
    /// The ROS 2 node failed.
    #[cfg(feature = "ros2")]
    #[error("ROS 2: {0}")]
    Ros2(#[from] crate::ros::node::NodeError),
    /// The source failed.
    #[error("{}", with_hint(.0, .0.hint()))]
    Source(LinkError),
    /// Several feet cannot be written to one table.
    #[error(
        "{file} has several feet, and a table has one: {}; choose one with --topic, or write .mcap",
        feet.join(", ")
    )]
    OneFootOnly {
        /// Recording as given.
        file: String,
        /// Names of the feet.
        feet: Vec<String>,
    },
    /// A foot is calibrated where there are settings of single feet, and it is not named.
    #[error("there are settings of the foot {0} alone: --foot names the one that is calibrated")]
    WhichFoot(String),
    /// One of several feet cannot be calibrated.
    #[error("foot {foot}: {source}")]
    OfFoot {
        /// Name of the foot.
        foot: String,
        /// Reason.
        source: Box<Error>,
    },
    /// A variable of the environment has no valid value.
    #[error("the variable {name} is wrong: {reason}")]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Reason, with the value.
        reason: String,
    },
    /// Options about recordings of an IMU are given for feet that stream.
    #[error(
        "{0} has no recording of an IMU: --config, --topic, --load-topic, --axes, --units and their like are for file:"
    )]
    NotPlayed(String),
    /// A bag has a topic that contacts are written to.
    #[error(
        "{file} has the topic {topic} already: its messages are those of an earlier estimate, or of another program; --estimate-again writes new ones in their place"
    )]
    TopicTaken {
        /// Bag as given.
        file: String,
        /// Topic of the contacts of a foot, or of messages of all feet.
        topic: String,
    },
    /// Messages of all feet are wanted of contacts that are copied as they are.
    #[error(
        "{file} has contacts, which are copied as they were recorded: {option} needs --estimate-again"
    )]
    CopiedContacts {
        /// Bag as given.
        file: String,
        /// Option of the messages.
        option: &'static str,
    },
    /// A foot has no place in messages of all feet.
    #[error(
        "the foot {name} has no place of its own in the messages of all feet, which are those of FL, FR, RL and RR: name it, as in --rename {name}=FL, or leave its topic out with --not-topic"
    )]
    NoPlace {
        /// Name of the foot.
        name: String,
    },
    /// Messages whose forces are to be replaced have none.
    #[error("{file}, topic {topic}: no forces of four feet to replace: {what}")]
    NoForces {
        /// Bag as given.
        file: String,
        /// Topic of the robot's states.
        topic: String,
        /// Half a sentence on the cause.
        what: String,
    },
    /// Axes are given for a foot that is not in the recordings.
    #[error("{}", in_words(.0))]
    NoSuchFoot(#[from] NoSuchFoot),
    /// The viewer server failed.
    #[cfg(feature = "foxglove")]
    #[error(transparent)]
    View(#[from] crate::commands::view::server::ViewError),
    /// The summary cannot be printed.
    #[error("the summary cannot be printed: {0}")]
    Print(#[source] io::Error),
}

/// An error of another kind that has ended the writing is that error.
impl From<OutputError> for Error {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Unwritable { file, source } => source
                .downcast()
                .unwrap_or_else(|source| Self::Output(OutputError::Unwritable { file, source })),
            error => Self::Output(error),
        }
    }
}

/// An error of the recording that a source plays is that error.
impl From<LinkError> for Error {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Recording(error) => match *error {
                RecordingError::Input(error) => error.into(),
                RecordingError::Parameters(error) => error.into(),
                RecordingError::NoSuchFoot(error) => error.into(),
            },
            error => Self::Source(error),
        }
    }
}

/// An unsupported format is reported as a missing feature.
impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        if let Problem::NotBuilt { feature, .. } = error.problem
            && let Some(feature) = Feature::of_name(feature)
        {
            Self::NotBuilt(feature.missing_for(error.file))
        } else {
            Self::Input(error)
        }
    }
}
