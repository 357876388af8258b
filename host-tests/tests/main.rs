//! Checks from outside, in one program: recordings, the oracle, simulated truth. Tests of the foot's program on a host are in
//! `foot/main.rs`.
//!
//! The feature `full` adds the tests that only `.ci/full` runs: bags and browsers.

#[cfg(feature = "full")]
use host_tests::requirements::unmet;

#[path = "../../wire/tests/python/environment.rs"]
mod environment;
mod labelled;
#[cfg(feature = "full")]
#[path = "python/packages.rs"]
mod packages;

mod accuracy;
mod atlas;
#[path = "attacks/main.rs"]
mod attacks;
mod attitude;
#[cfg(feature = "full")]
mod bag_copies;
mod broad;
mod calibrate;
mod can_logs;
mod consumers;
#[cfg(feature = "full")]
mod convert;
mod decode;
mod demo;
mod documents;
mod drift;
mod events;
mod faults;
mod feather_rp2350;
mod feet;
mod for_programs;
mod go1;
mod hanging;
mod learning;
mod mounting;
#[cfg(feature = "full")]
mod page;
mod pictures;
mod properties;
mod rates;
#[cfg(feature = "full")]
mod record;
mod recordings;
mod ringing;
#[cfg(feature = "full")]
mod roads;
mod robustness;
mod ros2_control;
mod self_check;
mod settings;
mod slip;
