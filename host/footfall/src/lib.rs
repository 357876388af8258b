//! The `footfall` program: estimates from recordings as tables, numbers and pictures.
//!
//! Processing steps of a recording, one module per step; some steps are crates.
//!
//! | step | module or crate |
//! |---|---|
//! | command line, one file per command | [`commands`] |
//! | parameters from preset, file and options | [`recordings::config`] |
//! | reading a recording | [`recordings::input`], with a bar from [`progress`] |
//! | or simulating a walk | [`gait`] |
//! | checking the output files | [`files`] |
//! | running the estimator, sample by sample | [`recordings::replay`], drawn and written by [`commands::replay`] |
//! | or calibrating: learning a foot in advance, or finding sensor errors | [`recordings::calibrate`] |
//! | or converting to another format | [`commands::convert`] |
//! | scoring the estimates | [`recordings::scoring`] |
//! | simulating and decoding the output of a foot | [`feet::robot::walk`], [`feet::decode`] |
//! | streaming feet | [`feet`], [`commands::monitor`]; as messages [`stream`], [`mod@ros`], in viewers [`commands::view`] |
//! | writing the results | [`recordings::output`], [`plot`], [`recordings::summary`], combined by [`report`], which prints them as text or JSON |
//! | writing files, and removing unfinished ones on interruption | [`files`], [`interruption`] |
//! //! | messages on standard error | [`messages`] |
//! | optional features | [`feature`] |

pub mod commands;
pub mod error;
pub mod feature;
pub mod files;
pub mod foot_error;
pub mod interruption;
pub mod messages;
pub mod plot;
pub mod progress;
pub mod report;
pub mod ros;
pub mod stream;

pub use error::Error;
