//! What a simulated board puts around [`firmware::Foot`], and the bus that it is on.

use estimator_core::{ImuSample, Timestamp};
use firmware::Start;
use firmware::sampling::{Activity, Measurement};
use gait::control::LOAD_OVER_CAN;
use lsm6dsox::RawSample;
use wire::dictionary::index;
use wire::{Address, Settings};

/// Time 0 of a simulated clock in logs, which need a date: the first of January 2021, µs since 1970.
const EPOCH_US: u64 = 1_609_459_200_000_000;

/// Name of the CAN interface in logs.
pub const INTERFACE: &str = "can0";

/// Time of a frame of 8 bytes on a bus of 1 Mbit/s, µs: 111 bits, stuff bits not counted.
const FRAME_US: u64 = 111;

/// The highest level of the brown-out reset, which a board sets at its first start.
const BROWN_OUT_LEVEL: u8 = 3;

/// A time of the simulated clock as logs have it, since 1970.
#[must_use]
pub const fn in_logs(time: Timestamp) -> Timestamp {
    Timestamp::from_micros(EPOCH_US + time.as_micros())
}

/// The default settings, but with the load over CAN: a simulated robot knows it.
#[must_use]
pub fn settings() -> Settings {
    let mut settings = Settings::default();
    let set = settings.set(Address::new(index::LOAD_INPUT, 1), LOAD_OVER_CAN);
    debug_assert_eq!(set, Ok(()), "the dictionary has this value");
    settings
}

/// The start of a board that is switched on.
#[must_use]
pub fn switched_on(serial: u32) -> Start {
    Start {
        serial,
        brown_out_level: BROWN_OUT_LEVEL,
        ..Start::default()
    }
}

/// What sampling makes of a sample of a sensor without faults.
#[must_use]
pub const fn measurement(sample: ImuSample, raw: Option<RawSample>) -> Measurement {
    Measurement {
        sample,
        raw,
        activity: Activity::Measuring,
        fault: None,
        saturated_for_long: false,
        restarts: 0,
    }
}

/// A bus of 1 Mbit/s: it carries one frame after the other.
#[derive(Clone, Debug, Default)]
pub struct Bus {
    free_us: u64,
}

impl Bus {
    /// Carries a frame that is ready at `ready`; returns when it is complete.
    pub fn carry(&mut self, ready: Timestamp) -> Timestamp {
        self.free_us = self.free_us.max(ready.as_micros()) + FRAME_US;
        Timestamp::from_micros(self.free_us)
    }
}
