//! The LSM6DSOX, accelerometer and gyroscope, over SPI.
//!
//! The path of a sample, one module a step:
//!
//! | step | module |
//! |---|---|
//! | the registers: addresses, fields, values after reset | [`register`] |
//! | settings, checked, and their register values | [`config`] |
//! | init, burst, FIFO, self-test on the bus | [`driver`] (blocking), [`asynch`] |
//! | sixteen bytes → codes that carry their scale → SI units | [`sample`], [`scale`] |
//! | what the setting's noise is | [`noise`] |
//! | the part's own clock | [`timestamp`] |
//! | batches of tagged words | [`fifo`] |
//! | ST's self-test and its limits | [`self_test`] |
//! | a part that repeats itself | [`frozen`] |
//!
//! Facts about the part carry the mark of their source: **\[P\]** read in ST's own C driver,
//! **\[D\]** the datasheet of a register-compatible sibling (LSM6DSO32, LSM6DSO), **\[S\]**
//! secondary. The LSM6DSOX datasheet, DS12814, was not at hand: what is marked D or S has not
//! been checked against it.
//!
//! No allocation, no `unsafe`, no panic on any bytes from the bus.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

#[cfg(test)]
extern crate std;

pub mod asynch;
pub mod config;
pub mod driver;
pub mod error;
pub mod fifo;
pub mod frozen;
pub mod noise;
pub mod register;
pub mod sample;
pub mod scale;
pub mod self_test;
pub mod timestamp;

pub use config::{
    AccelFilter, AccelParams, Config, DataReady, DataReadyMode, FifoParams, Ftype, GyroFilter,
    GyroParams, Odr, Params, ParamsError, Pin, Sensor,
};
pub use driver::Lsm6dsox;
pub use error::Error;
pub use fifo::{FifoBatch, FifoData, FifoStatus, FifoWord, TagParityError, WordBytes};
pub use frozen::FrozenDetector;
pub use noise::Noise;
pub use sample::{RawSample, Sample, Status};
pub use scale::{AccelFullScale, Codes, GyroFullScale, TemperatureCode};
pub use self_test::SelfTest;
pub use timestamp::{FrequencyFine, SensorTimestamp};
