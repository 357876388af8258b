//! The LSM6DSOX, an accelerometer and gyroscope, over SPI or I²C.
//!
//! The path of a sample, one module per step:
//!
//! | step | module |
//! |---|---|
//! | registers: addresses, fields, values after reset | [`register`] |
//! | data rates, filters, pins | [`setting`] |
//! | validated settings, and their register values | [`config`] |
//! | SPI or I²C, and their clocks | [`bus`] |
//! | init, burst, self-test on the bus | [`driver`] (blocking), [`asynch`] |
//! | sixteen bytes → codes that carry their scale → SI units | [`sample`], [`scale`] |
//! | noise of the outputs at a setting | [`noise`] |
//! | ST's self-test and its limits | [`self_test`] |
//! | detection of repeated samples | [`frozen`] |
//! | samples of the estimator (feature `estimator`) | `imu` |
//! | simulated part, for hosts (feature `sim`) | `sim` |
//!
//! Facts about the part are marked with their source:
//!
//! - **\[P\]** ST's own C driver;
//! - **\[D\]** the datasheet of a register-compatible sibling (LSM6DSO32, LSM6DSO);
//! - **\[S\]** a secondary source.
//!
//! Check facts marked D or S against the part's data sheet, DS12814.
//!
//! The crate does not allocate, has no `unsafe`, and no bytes from the bus make it panic. The feature `sim` is for
//! hosts and allocates.
#![cfg_attr(
    feature = "sim",
    doc = r#"
```
use lsm6dsox::sim::{Part, Stimulus};
use lsm6dsox::{Config, Lsm6dsox};

// Any `SpiDevice` and `DelayNs` will do; here they belong to a simulated part lying still.
let part = Part::new(|_seconds: f64| Stimulus::REST).shared();
let mut sensor = Lsm6dsox::new(part.spi(), Config::FRESH_KILOHERTZ);
sensor.init(&mut part.delay())?;

part.advance_by(1_000_000); // A millisecond passes: the next tick of the timer.
let sample = sensor.sample()?.to_si();
assert!(sample.accel_fresh && sample.gyro_fresh && !sample.accel_saturated);
assert!((sample.specific_force[2] - 9.81).abs() < 0.2);
# Ok::<(), lsm6dsox::Error<core::convert::Infallible>>(())
```
"#
)]
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

#[cfg(any(test, feature = "sim"))]
extern crate std;

pub mod asynch;
pub mod bus;
pub mod config;
pub mod driver;
pub mod error;
pub mod frozen;
#[cfg(feature = "estimator")]
pub mod imu;
pub mod noise;
pub mod register;
pub mod sample;
pub mod scale;
pub mod self_test;
pub mod setting;
// The simulation runs only on hosts. Tests over random transactions check its indices.
#[cfg(feature = "sim")]
#[allow(clippy::indexing_slicing)]
pub mod sim;

pub use bus::{AsyncBus, Bus, BusSpeed, I2c, SPI_MAX_HERTZ, SPI_MODE, Sa0, SetBusSpeed};
pub use config::{AccelParams, Config, DataReady, GyroParams, Params, ParamsError, Write};
pub use driver::Lsm6dsox;
pub use error::Error;
pub use frozen::FrozenDetector;
pub use noise::Noise;
pub use sample::{RawSample, Sample, Status};
pub use scale::{AccelFullScale, Codes, FrequencyFine, GyroFullScale, TemperatureCode};
pub use self_test::SelfTest;
pub use setting::{AccelFilter, DataReadyMode, Ftype, GyroFilter, Odr, Pin, Sensor};

/// Compiles the README's examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
