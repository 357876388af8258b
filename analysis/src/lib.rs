//! What is made of a foot's recording. It prints nothing and reads no command line: the program and
//! the Python package are two ways to it.
//!
//! | step | module |
//! |---|---|
//! | the parameters, from preset, file and options | [`config`] |
//! | those in force, as JSON | [`parameters`] |
//! | the estimator runs over a recording, sample by sample, into tables | [`replay`] |
//! | what that comes to | [`summary`] |
//! | all recordings of a tree, into tables of Parquet | `batch`, with the feature `parquet` |
//! | files that are there whole or not at all | [`whole_file`] |
//! | what belongs to one robot: learnt values, mounting, errors of the sensor | [`calibrate`] |

#[cfg(feature = "parquet")]
pub mod batch;
pub mod calibrate;
pub mod config;
pub mod parameters;
pub mod replay;
pub mod summary;
pub mod whole_file;
