//! Why recordings cannot be scored.

use estimator_core::ParamsError;
use footfall::files::OutputError;
use recordings::input::InputError;
use thiserror::Error;

/// Why recordings cannot be scored.
#[derive(Debug, Error)]
pub enum Error {
    /// A recording cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A recording to be evaluated is absent.
    #[error("{file} is not there; --datasets names the folder above it, the file is from {origin}")]
    NoDataset {
        /// The file.
        file: String,
        /// Where it can be had.
        origin: &'static str,
    },
    /// A table of true positions or speeds is not that of its recording.
    #[error("{file} lacks a column, or has other rows than its recording")]
    Truth {
        /// The file.
        file: String,
    },
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The parameters are not valid.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
}
