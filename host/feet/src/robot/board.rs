//! Simulated board around [`firmware::Foot`], and its bus.

use estimator_core::{ImuSample, Timestamp};
use firmware::Start;
use firmware::sampling::{Activity, Measurement, ReadAt};
use gait::control::LOAD_OVER_CAN;
use lsm6dsox::RawSample;
use wire::dictionary::index;
use wire::{Address, Settings};

/// Time 0 of a simulated clock in logs, which need a date: 1 January 2021, µs since 1970.
const EPOCH_US: u64 = 1_609_459_200_000_000;

/// Name of the CAN interface in logs.
pub const INTERFACE: &str = "can0";

/// Duration of a frame of 8 bytes on a bus of 1 Mbit/s, µs: 111 bits without stuff bits.
const FRAME_US: u64 = 111;

/// Highest level of the brown-out reset, which a board has from its second power-up on.
const BROWN_OUT_LEVEL: u8 = 3;

/// Converts a time of the simulated clock to that of logs, since 1970.
#[must_use]
pub const fn in_logs(time: Timestamp) -> Timestamp {
    Timestamp::from_micros(EPOCH_US + time.as_micros())
}

/// Default settings with the load over CAN, which a simulated robot reports.
#[must_use]
pub fn settings() -> Settings {
    let mut settings = Settings::default();
    let set = settings.set(Address::new(index::LOAD_INPUT, 1), LOAD_OVER_CAN);
    debug_assert_eq!(set, Ok(()), "the dictionary has this value");
    settings
}

/// Start of a board at power-on.
#[must_use]
pub fn switched_on(serial: u32) -> Start {
    Start { serial, hardware: "simulated", brown_out_level: BROWN_OUT_LEVEL, ..Start::default() }
}

/// Measurement of a sensor without faults.
#[must_use]
pub const fn measurement(sample: ImuSample, raw: Option<RawSample>) -> Measurement {
    Measurement {
        sample,
        raw,
        activity: Activity::Measuring,
        fault: None,
        read_at: ReadAt::Edge,
        saturated_for_long: false,
        restarts: 0,
        misreads: 0,
    }
}

/// Bus of 1 Mbit/s, which carries one frame at a time.
#[derive(Clone, Debug, Default)]
pub struct Bus {
    free_us: u64,
}

impl Bus {
    /// Carries a frame that is ready at `ready`; returns the time of its end.
    pub fn carry(&mut self, ready: Timestamp) -> Timestamp {
        self.free_us = self.free_us.max(ready.as_micros()) + FRAME_US;
        Timestamp::from_micros(self.free_us)
    }
}
