//! Processing of foot recordings, without console output or command line, for the program and the Python package.
//!
//! | step | module |
//! |---|---|
//! | parameters in force, as JSON | [`parameters`] |
//! | estimator over a recording, sample by sample, into tables | [`replay`] |
//! | summary of the results | [`summary`] |
//! | files written completely or not at all | [`whole_file`] |
//! | values of one robot: learnt values, mounting, sensor errors | [`calibrate`] |

pub mod calibrate;
pub mod parameters;
pub mod replay;
pub mod summary;
pub mod whole_file;
