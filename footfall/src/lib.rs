//! The `footfall` program: recordings in, probabilities, numbers and pictures out.
//!
//! The path of a recording, one module a step; a crate where the step has one of its own:
//!
//! | step | module or crate |
//! |---|---|
//! | the command line, one command a file | [`commands`] |
//! | the parameters, from preset, file and options | [`analysis::config`] |
//! | a file becomes a recording | [`recordings::input`], with a bar from [`progress`] |
//! | or a simulated foot walks one | [`gait`] |
//! | whether the results can be written | [`targets`] |
//! | the estimator runs over it, sample by sample | [`analysis::replay`], drawn by [`replay`] |
//! | or learns a foot in advance, or finds what is wrong with the sensor | [`analysis::calibrate`] |
//! | or becomes a file of another format | [`convert`] |
//! | how good that was | [`scoring`]; as a report [`attitude`] |
//! | what the foot sends of it, and back again | [`walking_foot`], [`mod@decode`] |
//! | feet that stream, from a source that is read by a thread | [`monitor`], [`mod@live`], [`mod@ros`]; as messages [`stream`], for viewers [`view`] |
//! | the table, the picture, the summary | [`recordings::output`], [`plot`], [`analysis::summary`], put together by [`report`] |
//! | a result becomes a file | [`files`]; nothing is left of one that is interrupted: [`interruption`] |
//! | results as JSON: the parameters in force, the schemas | [`analysis::parameters`], [`schema`] |
//! | what is said on standard error | [`messages`] |
//! | what is built only where it is asked for | [`feature`] |

pub mod attitude;
pub mod commands;
pub mod convert;
pub mod error;
pub mod feature;
pub mod files;
pub mod interruption;
pub mod mcap_recording;
pub mod messages;
pub mod monitor;
pub mod plot;
pub mod progress;
pub mod replay;
pub mod report;
pub mod schema;
pub mod stream;
pub mod targets;
pub mod view;
pub mod walking_foot;

pub use error::Error;
