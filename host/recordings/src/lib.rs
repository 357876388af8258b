//! Recordings of a foot: read from files, replayed through the estimator, and written to tables.
//!
//! | step | module |
//! |---|---|
//! | reading a file into a stored recording | [`input`] |
//! | a sample with its load and label, in memory; many samples in a temporary file | [`samples`], [`spool`] |
//! | parameters, from preset, configuration file and options | [`config`] |
//! | the estimator applied to a recording, sample by sample or in memory | [`estimate`] |
//! | a stored recording through the estimator, into tables, events and a summary | [`replay`], several in parallel by [`jobs`] |
//! | touch-downs, lift-offs and slips among the estimates | [`events`] |
//! | implausible values in a recording | [`plausible`] |
//! | accuracy of probabilities and orientations | [`scoring`] |
//! | summary of a replay, with the parameters of its estimate | [`summary`] |
//! | tables of samples and estimates, in CSV and Parquet | [`output`], `parquet_output` |
//! | values of one robot: learnt values, sensor errors | [`calibrate`] |
//! | mounting of a sensor in the foot: as text, from gravity at rest, as a report | [`mounting`] |
//! | files written completely or not at all | [`whole_file`] |
//!
//! | part | module |
//! |---|---|
//! | kinds of files by their first bytes; gzip and zstd | [`file_kind`], [`compressed`] |
//! | hints of errors, findings and notices, in the words of a program | [`hint`] |
//! | messages of ROS 2 | [`ros`] |
//! | vectors and rotations in f64 | [`space`] |
//! | numbers in messages, enums whose variants have names | [`number`], [`mod@named`] |

pub mod calibrate;
pub mod compressed;
pub mod config;
pub mod estimate;
pub mod events;
pub mod file_kind;
pub mod hint;
pub mod input;
pub mod jobs;
pub mod mounting;
pub mod named;
pub mod number;
pub mod output;
#[cfg(feature = "parquet")]
pub mod parquet_output;
pub mod plausible;
pub mod replay;
pub mod ros;
pub mod samples;
pub mod scoring;
pub mod space;
pub mod spool;
pub mod summary;
mod utf16;
pub mod whole_file;
