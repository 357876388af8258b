//! footfall on the host: recordings in, probabilities, numbers and pictures out.
//!
//! The path of a recording, one module a step:
//!
//! | step | module |
//! |---|---|
//! | what the command line says | [`cli`] |
//! | which parameters that makes | [`config`] |
//! | a file becomes a [`Recording`](recording::Recording) | [`input`] |
//! | or a simulated foot walks one | [`gait`], by way of [`demo`] |
//! | results have somewhere to go | [`targets`] |
//! | the estimator runs over it | [`replay`] |
//! | or learns a foot in advance, or finds what is wrong with the sensor | [`calibrate`] |
//! | how good that was | [`metrics`], [`reliability`], and of its orientation [`attitude`]; beside other methods, [`evaluate`] |
//! | what the foot sends of it, and back again | [`transmit`], [`can_log`], [`decode`] |
//! | the table, the picture, the summary | [`output`], [`plot`], [`summary`], put together by [`report`] |

pub mod attitude;
pub mod calibrate;
pub mod can_log;
pub mod cli;
pub mod config;
pub mod decode;
pub mod demo;
pub mod error;
pub mod evaluate;
pub mod gait;
pub mod input;
pub mod metrics;
mod number;
pub mod output;
pub mod plot;
mod progress;
pub mod recording;
pub mod reliability;
pub mod replay;
pub mod report;
pub mod summary;
pub mod targets;
pub mod transmit;

pub use error::Error;
