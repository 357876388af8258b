//! Pins that a peripheral needs: a program that uses it without them fails the run, with the name of the pin.

use super::Chip;
use crate::emulator::wiring::Connection;

impl Chip {
    /// Checks that pins are connected to their peripheral.
    pub(super) fn check_connections(&self, connections: &[Connection]) -> Result<(), String> {
        match connections.iter().find(|made| !made.is_made(&self.ports)) {
            None => Ok(()),
            Some(missing) => Err(format!(
                "{} is used, and {} is not connected to it",
                missing.name,
                missing.pin.name()
            )),
        }
    }

    /// Checks that no pin is driven that the board connects to a supply.
    pub(super) fn check_tied_pins(&self, port: usize) -> Result<(), String> {
        const OUTPUT: u32 = 1;
        const ALTERNATE: u32 = 2;
        let is_driven = |number| matches!(self.ports[port].mode(number), OUTPUT | ALTERNATE);
        let mut tied = self.wiring.tied.iter().filter(|pin| pin.port == port);
        match tied.find(|pin| is_driven(pin.number)) {
            None => Ok(()),
            Some(pin) => {
                Err(format!("{} is driven, and the board connects it to a supply", pin.name()))
            }
        }
    }
}
