//! Program of a simulated board: [`firmware::Foot`] with its ports.

use estimator_core::{ParamsError, Timestamp};
use firmware::sampling::{Measurement, Tick};
use firmware::{Foot, Ports, Start};
use wire::{CanFrame, Settings};

/// Program of a board between two resets.
pub(super) struct Program {
    pub(super) foot: Foot,
    pub(super) ports: Ports,
}

impl Program {
    /// Starts the program.
    ///
    /// # Errors
    /// The parameters of the settings are inconsistent.
    pub(super) fn new(settings: Settings, start: Start) -> Result<Self, ParamsError> {
        Ok(Self { foot: Foot::new(settings, start)?, ports: Ports::new() })
    }

    /// Runs the program for the millisecond that begins at `time`; the data-ready edge is at the time of the sample.
    pub(super) fn tick(&mut self, time: Timestamp, measurement: &Measurement) {
        let tick = Tick { time, edge: Some(measurement.sample.timestamp), ..Tick::default() };
        self.foot.tick(&tick, measurement, None, &self.ports);
    }

    /// Takes the pending frames for the bus.
    pub(super) fn frames(&mut self) -> impl Iterator<Item = CanFrame> + '_ {
        std::iter::from_fn(|| self.ports.try_next_can())
    }

    /// Takes the pending bytes for the serial line.
    pub(super) fn take_serial(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some(frame) = self.ports.try_next_uart() {
            bytes.extend_from_slice(frame.as_bytes());
        }
        bytes
    }
}
