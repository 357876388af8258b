//! The program as its users run it: each command, its output, its files and its errors.

mod common;
#[cfg(any(feature = "bags", feature = "foxglove", feature = "parquet", feature = "ros2"))]
#[path = "../../../wire/tests/python/environment.rs"]
mod environment;
#[cfg(any(feature = "bags", feature = "foxglove", feature = "parquet", feature = "ros2"))]
#[path = "../../../host-tests/tests/python/packages.rs"]
mod packages;
#[cfg(any(feature = "bags", feature = "foxglove", feature = "parquet", feature = "ros2"))]
use common::unmet;

mod axes;
mod calibrate;
mod command_line;
#[cfg(all(feature = "bags", feature = "parquet"))]
mod convert;
mod decode;
mod demo;
mod events;
mod features;
mod foot;
mod monitor;
#[cfg(feature = "bags")]
mod others;
mod overwrite;
mod pages;
mod plausible;
#[cfg(all(feature = "bags", feature = "foxglove", feature = "ros2"))]
mod played;
#[cfg(feature = "bags")]
mod record;
#[cfg(all(feature = "bags", feature = "parquet"))]
mod recorded;
mod replay;
mod replay_refusals;
#[cfg(feature = "ros2")]
mod ros2;
mod several;
mod tables;
#[cfg(feature = "ros2")]
mod topics;
#[cfg(feature = "foxglove")]
mod view;
