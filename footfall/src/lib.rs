//! The `footfall` program: recordings in, probabilities, numbers and pictures out.
//!
//! The path of a recording, one module a step; a crate where the step has one of its own:
//!
//! | step | module or crate |
//! |---|---|
//! | the command line, one command a file | [`commands`] |
//! | the parameters, from preset, file and options | [`config`] |
//! | a file becomes a recording | [`recordings::input`], with a bar from [`progress`] |
//! | or a simulated foot walks one | [`gait`] |
//! | whether the results can be written | [`targets`] |
//! | the estimator runs over it, sample by sample | [`replay`] with [`recordings::replay`] |
//! | or learns a foot in advance, or finds what is wrong with the sensor | [`calibrate`] |
//! | how good that was | [`scoring`]; as a report [`attitude`], as tables and pictures [`evaluate`] |
//! | what the foot sends of it, and back again | [`walking_foot`], [`can_log`], [`decode`] |
//! | the table, the picture, the summary | [`recordings::output`], [`plot`], [`summary`], put together by [`report`] |
//! | a result becomes a file | [`files`] |
//! | results as JSON: the parameters in force, the schemas | [`parameters`], [`schema`] |
//! | what is said on standard error | [`messages`] |

pub mod attitude;
pub mod calibrate;
pub mod can_log;
pub mod commands;
pub mod config;
pub mod decode;
pub mod error;
pub mod evaluate;
pub mod files;
pub mod messages;
pub mod parameters;
pub mod plot;
pub mod progress;
pub mod replay;
pub mod report;
pub mod schema;
pub mod summary;
pub mod targets;
pub mod walking_foot;

pub use error::Error;
