//! Errors of the evaluation.

use estimator_core::ParamsError;
use footfall::files::OutputError;
use recordings::input::InputError;
use thiserror::Error;

/// Error of the evaluation.
#[derive(Debug, Error)]
pub enum Error {
    /// A recording cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A recording is missing.
    #[error("{file} is not there; --datasets names the folder above it, the file is from {origin}")]
    NoDataset {
        /// The file.
        file: String,
        /// Origin of the file.
        origin: &'static str,
    },
    /// A table of true positions or speeds does not match its recording.
    #[error("{file} lacks a column, or has other rows than its recording")]
    Truth {
        /// The file.
        file: String,
    },
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The parameters are invalid.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
}
