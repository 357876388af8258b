//! Checks from outside, in one program: recordings, the oracle, generated files. Tests of the foot's program on a host are in
//! `foot/main.rs`, those of the estimate's behaviour in `thorough.rs`.
//!
//! The feature `full` adds the tests that only `.ci/full` runs: bags and browsers.

#[cfg(feature = "full")]
use host_tests::requirements::unmet;

#[cfg(feature = "full")]
#[path = "../../wire/tests/python/environment.rs"]
mod environment;
#[cfg(feature = "full")]
#[path = "python/packages.rs"]
mod packages;

mod accuracy;
mod atlas;
#[cfg(feature = "full")]
mod bag_copies;
mod consumers;
#[cfg(feature = "full")]
mod convert;
mod decode;
mod demo;
mod faults;
mod for_programs;
mod go1;
#[cfg(feature = "full")]
mod page;
mod pictures;
mod properties;
#[cfg(feature = "full")]
mod record;
mod recordings;
#[cfg(feature = "full")]
mod roads;
mod ros2_control;
mod settings;
