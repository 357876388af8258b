//! Why a command failed: [`enum@Error`], one sentence in the words of the command line.
//!
//! An error is defined in the file where it arises. Errors of the libraries name options through
//! [`words`](crate::words), so each kind has a variant here. All other errors have a whole sentence as their text,
//! which the trait [`Worded`] marks.

use std::io;

use calibration::CalibrationError;
use config::{ConfigError, NoSuchFoot, ParameterRefusal};
use estimator_core::ParamsError;
use feet::decode::DecodeError;
use feet::decode::known_feet::NamedTwice;
use feet::foot::RequestError;
use feet::foot::accept::AcceptError;
use feet::foot::name::NameError;
use feet::foot::self_test::SelfTestError;
use feet::foot::settings::SettingsError;
use feet::link::{LinkError, RecordingError};
use replay::ReplayError;
use stored::error::{InputError, Problem};
use thiserror::Error;

use crate::feature::{Feature, NotBuilt};
use crate::files::OutputError;
use crate::ros::compat::MixedBodies;
use crate::words::{in_words, with_hint};

/// Reason a command failed.
#[derive(Debug, Error)]
pub enum Error {
    /// Any error that has its whole sentence.
    #[error(transparent)]
    Worded(Box<dyn std::error::Error + Send + Sync>),
    /// The recording cannot be used.
    #[error("{}", in_words(.0))]
    Input(InputError),
    /// The parameters are invalid; described by the estimator.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The parameters are invalid; described by the option or key that sets them.
    #[error("{}", in_words(.0))]
    Refused(#[from] ParameterRefusal),
    /// Axes are given for a foot that is not in the recordings.
    #[error("{}", in_words(.0))]
    NoSuchFoot(#[from] NoSuchFoot),
    /// The recordings do not contain the data a calibration needs.
    #[error("{}", in_words(.0))]
    Calibration(#[from] CalibrationError),
    /// The source failed.
    #[error("{}", with_hint(.0, .0.hint()))]
    Source(LinkError),
    /// A request to a foot failed.
    #[error("{}", with_hint(.0, .0.hint()))]
    Request(#[from] RequestError),
    /// The name of a setting is unknown, or its value is not accepted.
    #[error("{}", with_hint(.0, .0.hint()))]
    Name(#[from] NameError),
    /// Settings were rejected.
    #[error("{}", with_hint(.0, .0.hint()))]
    Settings(#[from] SettingsError),
    /// A board cannot be measured further.
    #[error("{}", with_hint(.0, .0.hint()))]
    Accept(#[from] AcceptError),
    /// The self-test gave no verdict.
    #[error("{}", with_hint(.0, .0.hint()))]
    SelfTest(#[from] SelfTestError),
    /// Standard output cannot be written.
    #[error("standard output cannot be written: {0}")]
    Print(#[source] io::Error),
}

/// An error whose message is a whole sentence in the words of the command line, so that it needs no option added.
pub trait Worded: std::error::Error + Send + Sync + 'static {}

impl Worded for NotBuilt {}
impl Worded for ConfigError {}
impl Worded for DecodeError {}
impl Worded for NamedTwice {}
impl Worded for ReplayError {}
impl Worded for MixedBodies {}

impl<E: Worded> From<E> for Error {
    fn from(error: E) -> Self {
        Self::Worded(Box::new(error))
    }
}

impl Error {
    /// Returns whether this is the error `E`, which has its whole sentence.
    pub fn is<E: Worded>(&self) -> bool {
        matches!(self, Self::Worded(error) if error.is::<E>())
    }
}

/// Unpacks an [`enum@Error`] that the writing function has put into an [`std::io::Error`].
impl From<OutputError> for Error {
    fn from(error: OutputError) -> Self {
        let whole = |error| Self::Worded(Box::new(error));
        match error {
            OutputError::Unwritable { file, source } => source
                .downcast()
                .unwrap_or_else(|source| whole(OutputError::Unwritable { file, source })),
            error => whole(error),
        }
    }
}

/// Unpacks the error of a recording that a source plays.
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
            feature.missing_for(error.file).into()
        } else {
            Self::Input(error)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn errors_name_options_and_commands_of_this_program() {
        for (error, expected) in [
            (
                Error::from(RequestError::SeveralFeet(vec![17, 18])),
                "there are several feet, 17, 18: name one with --node",
            ),
            (
                NameError::Unknown("windw".to_owned()).into(),
                "no object has the name \"windw\"; `footfall foot SOURCE get` lists all",
            ),
            (
                SelfTestError::StaysOn(RequestError::NoFoot).into(),
                "no foot was found on this line; the self-test stays on at each start until footfall foot … set self_test_at_start=0 --save",
            ),
            (RequestError::NoFoot.into(), "no foot was found on this line"),
        ] {
            assert_eq!(error.to_string(), expected);
        }
    }

    #[test]
    fn error_in_the_content_of_a_file_is_not_one_of_its_writing() {
        let cause = Error::from(RequestError::NoFoot);
        let written = OutputError::unwritable(Path::new("x.csv"))(io::Error::other(cause));
        assert_eq!(Error::from(written).to_string(), "no foot was found on this line");
        let full = OutputError::unwritable(Path::new("x.csv"))(io::ErrorKind::StorageFull.into());
        assert!(Error::from(full).to_string().starts_with("x.csv"));
    }
}
