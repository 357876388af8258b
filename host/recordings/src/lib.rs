//! Recordings of a foot: read from files, replayed through the estimator, and written to tables.
//!
//! | step | module |
//! |---|---|
//! | samples with their load and label, vectors in f64, names of validities, codes of phases | [`samples`] |
//! | reading a file into a recording | [`input`] |
//! | parameters, from preset, file and options | [`config`] |
//! | what a foot's recording comes to: tables, a summary, a calibration | [`analysis`] |
//! | how good probabilities and orientations are | [`scoring`] |
//! | samples in a temporary file, steps of a clock | [`spool`], `steps` |
//! | implausible values in a recording | [`plausible`] |
//! | mounting of the sensor, from gravity at rest | [`mounting`] |
//! | the estimator applied to a recording | [`replay`] |
//! | messages of ROS 2 | [`ros`] |
//! | tables of samples and estimates | [`output`], `parquet_output` |
//! | tables of samples in Parquet | `parquet_samples` |
//! | rows of any table in Parquet | `parquet_rows` |
//! | touch-downs, lift-offs and slips among the estimates | [`events`] |
//! | numbers in messages | [`number`] |

pub mod analysis;
pub mod config;
pub mod events;
pub mod input;
pub mod mounting;
pub mod number;
pub mod output;
#[cfg(feature = "parquet")]
pub mod parquet_output;
#[cfg(feature = "parquet")]
mod parquet_rows;
#[cfg(feature = "parquet")]
pub mod parquet_samples;
pub mod plausible;
pub mod replay;
pub mod ros;
pub mod samples;
pub mod scoring;
pub mod spool;
mod steps;
