//! When each PDO is sent, as the settings say, and the bus load of that.

use super::Settings;
use crate::dictionary::{self, PDO_OFF, index};
use crate::pdo::{PDOS, Pdo};

/// Transmission trigger of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// Never.
    Off,
    /// Every N ticks of 1 ms.
    Ticks(u16),
    /// With every N-th SYNC.
    Sync(u8),
}

/// Slots of the settings that trigger each PDO: identifier, transmission type, event timer.
#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
const TRIGGERS: [[usize; 3]; PDOS] = {
    let mut slots = [[0; 3]; PDOS];
    let mut i = 0;
    while i < PDOS {
        let object = index::TPDO + i as u16;
        slots[i] = [
            dictionary::slot_of(object, 1),
            dictionary::slot_of(object, 2),
            dictionary::slot_of(object, 5),
        ];
        i += 1;
    }
    slots
};

impl Settings {
    /// Transmission trigger of a PDO.
    #[must_use]
    pub fn trigger(&self, pdo: Pdo) -> Trigger {
        let [id, transmission, period] = TRIGGERS.get(pdo as usize).copied().unwrap_or_default();
        if self.value(id) & PDO_OFF != 0 {
            return Trigger::Off;
        }
        match self.u8(transmission) {
            every @ 1..=240 => Trigger::Sync(every),
            _ => match self.u16(period) {
                0 => Trigger::Off,
                period => Trigger::Ticks(period),
            },
        }
    }

    /// Maximum bus load of the foot's own streams and heartbeat, bit/s.
    /// PDOs tied to SYNC are counted for 100 SYNCs a second.
    #[must_use]
    pub fn worst_load(&self) -> u32 {
        let pdos = Pdo::ALL.into_iter().map(|pdo| match self.trigger(pdo) {
            Trigger::Off => 0,
            Trigger::Ticks(period) => longest_frame(8) * 1000 / u32::from(period).max(1),
            Trigger::Sync(every) => longest_frame(8) * 100 / u32::from(every).max(1),
        });
        let heartbeat = longest_frame(1) * 1000;
        let heartbeat = heartbeat.checked_div(u32::from(self.heartbeat_ms()));
        pdos.sum::<u32>() + heartbeat.unwrap_or(0)
    }
}

/// Maximum length of a data frame of N bytes on the bus, bits: 34 bits are stuffed before the
/// data, one more with every four bits after the first; then delimiter, acknowledgement, end of
/// frame and the space between frames. (Davis, Burns, Bril, Lukkien: *Controller Area Network (CAN)
/// schedulability analysis*, 2007, equation 1.)
#[must_use]
pub const fn longest_frame(bytes: u32) -> u32 {
    8 * bytes + 13 + 34 + (34 + 8 * bytes - 1) / 4
}
