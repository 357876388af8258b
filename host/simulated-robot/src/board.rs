//! Simulated board: its settings and start, its program around [`firmware::Foot`], its flash, and its bus.

use std::convert::Infallible;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use estimator_core::{ImuSample, ParamsError, Timestamp};
use firmware::exchange::Exchange;
use firmware::sampling::{Activity, BusHealth, Measurement, ReadAt, Tick};
use firmware::{Foot, Ports, Start, tasks};
use gait::control::LOAD_OVER_CAN;
use lsm6dsox::{BusSpeed, RawSample};
use wire::diagnosis::Reset;
use wire::dictionary::index;
use wire::{Address, CanFrame, Diagnosis, Settings};

/// Name of the CAN interface in logs.
pub const INTERFACE: &str = "can0";

/// Duration of a frame of 8 bytes on a bus of 1 Mbit/s, µs: 111 bits without stuff bits.
const FRAME_US: u64 = 111;

/// Highest level of the brown-out reset, which a board has from its second power-up on.
const BROWN_OUT_LEVEL: u8 = 3;

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
    Start {
        serial,
        hardware: "simulated",
        brown_out_level: Some(BROWN_OUT_LEVEL),
        diagnosis: Diagnosis { reset: Reset::Power, is_crystal_used: true, ..Diagnosis::default() },
        ..Start::default()
    }
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
        bus: BusHealth { identity: 0x6C, speed: BusSpeed::Full, errors: [0; 3] },
    }
}

/// Bus of 1 Mbit/s, which carries one frame at a time.
#[derive(Clone, Debug, Default)]
pub struct SimulatedBus {
    free_us: u64,
}

impl SimulatedBus {
    /// Occupies the bus with a frame that is ready at `ready`, once the bus is free. Returns the time of the frame's
    /// end.
    pub fn carry(&mut self, ready: Timestamp) -> Timestamp {
        self.free_us = self.free_us.max(ready.as_micros()) + FRAME_US;
        Timestamp::from_micros(self.free_us)
    }
}

/// Program of a board between two resets.
pub(crate) struct SimulatedProgram {
    pub(crate) foot: Foot,
    pub(crate) ports: Ports,
}

impl SimulatedProgram {
    /// Starts the program.
    ///
    /// # Errors
    /// The parameters of the settings are inconsistent.
    pub(crate) fn new(settings: Settings, start: Start) -> Result<Self, ParamsError> {
        Ok(Self { foot: Foot::new(settings, start)?, ports: Ports::new() })
    }

    /// Runs the program for the millisecond that begins at `time`; the data-ready edge is at the time of the sample.
    pub(crate) fn tick(&mut self, time: Timestamp, measurement: &Measurement) {
        let tick = Tick { time, edge: Some(measurement.sample.timestamp), ..Tick::default() };
        let exchange = &mut Exchange::new();
        tasks::run_tick(&mut self.foot, &self.ports, exchange, &tick, measurement, None);
    }

    /// Takes the pending frames for the bus.
    pub(crate) fn frames(&mut self) -> impl Iterator<Item = CanFrame> + '_ {
        std::iter::from_fn(|| self.ports.try_next_can())
    }

    /// Takes the pending bytes for the serial line.
    pub(crate) fn take_serial(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some(frame) = self.ports.try_next_uart() {
            bytes.extend_from_slice(&frame);
        }
        bytes
    }
}

/// Two pages of flash, which keep the settings: a write clears bits, an erase sets them.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedFlash(Vec<u8>);

impl SimulatedFlash {
    /// Size of a page, bytes.
    const PAGE: usize = 16 * 1024;

    /// Size of the two pages together, bytes.
    pub(crate) const SIZE: usize = 2 * Self::PAGE;

    pub(crate) fn blank() -> Self {
        Self(vec![0xFF; Self::SIZE])
    }
}

impl ErrorType for SimulatedFlash {
    type Error = Infallible;
}

impl ReadNorFlash for SimulatedFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        let stored = self.0.iter().skip(offset as usize);
        for (to, from) in bytes.iter_mut().zip(stored) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for SimulatedFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = Self::PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        if let Some(pages) = self.0.get_mut(from as usize..to as usize) {
            pages.fill(0xFF);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        for (to, from) in self.0.iter_mut().skip(offset as usize).zip(bytes) {
            *to &= *from;
        }
        Ok(())
    }
}
