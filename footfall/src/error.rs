//! Everything that can end a command, as one clear sentence each.

use std::io;

use estimator_core::ParamsError;
use thiserror::Error;

use crate::calibrate::CalibrationError;
use crate::config::{ConfigError, Refusal};
use crate::decode::DecodeError;
use crate::input::InputError;
use crate::output::OutputError;

/// Why a command could not do what it was asked.
#[derive(Debug, Error)]
pub enum Error {
    /// The recording cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// What was to be decoded cannot be.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A recording to be evaluated is absent.
    #[error("{file} is not there; --datasets names the folder above it, the file is from {origin}")]
    NoDataset {
        /// The file.
        file: String,
        /// Where it can be had.
        origin: &'static str,
    },
    /// The configuration file cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The parameters are not valid, in the estimator's words.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The parameters are not valid, in the words of whoever set them.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The recordings do not tell what they should.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A result could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The summary could not be printed.
    #[error("the summary cannot be printed: {0}")]
    Print(#[source] io::Error),
}
