//! The `footfall` program: estimates from recordings as tables, numbers and pictures.
//!
//! Each command is a file of [`commands`], from its arguments to its output. Commands share the other modules:
//!
//! | step | module or crate |
//! |---|---|
//! | options, and the parameters from preset, file and options | [`commands::options`], [`config`] |
//! | reading a recording | [`recordings`], with a bar from [`progress`] |
//! | running the estimator, sample by sample | [`replay`] |
//! | learning a foot in advance, or finding sensor errors | [`calibration`] |
//! | scoring the estimates | [`replay::scoring`] |
//! | syntax of a source of streaming feet | [`source`] |
//! | syntax of topics of ROS 2 as sources | [`topic_source`] |
//! | receiving streaming feet, and decoding their output | [`feet`] |
//! | streaming feet: reports, and messages of ROS 2 | [`stream`], [`mod@ros`] |
//! | simulating a walk, and the output of a foot | [`gait`], [`simulated_robot::walk`] |
//! | tables, pictures and summaries | [`tables::output`], [`plot`], [`replay::summary`] |
//! | summaries on standard output, as text or JSON | [`report`] |
//! | checking and writing output files | [`files`] |
//! | removing unfinished files on interruption | [`interruption`] |
//! | errors, their words, messages on standard error | [`error`], [`words`], [`messages`] |
//! | optional features | [`feature`] |

pub mod commands;
pub mod error;
pub mod feature;
pub mod files;
pub mod interruption;
pub mod messages;
pub mod plot;
pub mod progress;
pub mod report;
pub mod ros;
pub mod source;
pub mod stream;
pub mod topic_source;
pub mod words;

pub use error::Error;
pub use source::{Source, SourceArgument};
