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
//! | checking the output files | [`targets`] |
//! | running the estimator, sample by sample | [`recordings::analysis::replay`], drawn and written by [`replay_output`] |
//! | or calibrating: learning a foot in advance, or finding sensor errors | [`recordings::analysis::calibrate`] |
//! | or converting to another format | [`convert`] |
//! | scoring the estimates | [`recordings::scoring`] |
//! | simulating and decoding the output of a foot | [`feet::robot::walk`], [`feet::decode`] |
//! | streaming feet | [`monitor`], [`feet`], [`mod@ros`]; as messages [`stream`], in viewers [`view`] |
//! | writing the results | [`recordings::output`], [`plot`], [`recordings::analysis::summary`], combined by [`report`] |
//! | writing files, and removing unfinished ones on interruption | [`files`], [`interruption`] |
//! | JSON output | [`recordings::analysis::parameters`], [`json`] |
//! | messages on standard error | [`messages`] |
//! | optional features | [`feature`] |

#[cfg(feature = "bags")]
pub mod bag_copy;
pub mod commands;
pub mod convert;
pub mod error;
pub mod feature;
pub mod files;
pub mod foot_error;
pub mod foot_names;
pub mod interruption;
pub mod json;
#[cfg(feature = "bags")]
pub mod mcap_recording;
pub mod messages;
pub mod monitor;
pub mod plot;
pub mod program;
pub mod progress;
pub mod replay_output;
pub mod report;
pub mod ros;
pub mod stream;
pub mod targets;
pub mod view;

pub use error::Error;
