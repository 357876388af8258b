//! Process data as of one tick. Most frames are due on few ticks, so a tick keeps only the
//! estimate, and a frame is built when it is due or one of its objects is read.

use estimator_core::ContactEstimate;

use crate::dictionary::Address;
use crate::fault::Faults;
use crate::pdo::{Acceleration, Attitude, Axes, Bias, ClockReading, Contact, Health, Pdo, Rate};

/// Inputs of all process data.
#[derive(Clone, Debug, Default)]
pub(super) struct Snapshot {
    /// Whether there was a tick.
    pub(super) is_taken: bool,
    pub(super) estimate: ContactEstimate,
    /// Temperature of the sensor, °C.
    pub(super) temperature: f32,
    pub(super) faults: Faults,
    /// Frames dropped since the start.
    pub(super) dropped: u32,
    pub(super) last_sync: ClockReading,
    /// Sequence number of the contact.
    pub(super) sequence: u8,
}

impl Snapshot {
    /// Encodes a frame.
    pub(super) fn payload(&self, pdo: Pdo) -> [u8; 8] {
        let (estimate, faults) = (&self.estimate, self.faults);
        match pdo {
            Pdo::Contact => Contact::new(estimate, self.sequence, faults).encode(),
            Pdo::Axes => Axes::new(estimate, faults).encode(),
            Pdo::Attitude => Attitude::new(estimate, faults).encode(),
            Pdo::Acceleration => Acceleration::new(estimate, faults).encode(),
            Pdo::Rate => Rate::new(estimate, faults).encode(),
            Pdo::Bias => Bias::new(estimate, self.temperature, faults).encode(),
            Pdo::Health => {
                let register = faults.register();
                let clock = ClockReading::to_report(self.last_sync, estimate.timestamp);
                Health::new(estimate.flags, register, self.dropped, clock).encode()
            }
        }
    }

    /// Value of `address` in the PDO that maps it; 0 before the first tick.
    pub(super) fn value(&self, address: Address) -> Option<u32> {
        for pdo in Pdo::ALL {
            let mut offset = 0;
            for mapped in pdo.mapping() {
                if mapped.address == address {
                    let payload = if self.is_taken { self.payload(pdo) } else { [0; 8] };
                    return Some((u64::from_le_bytes(payload) >> offset) as u32);
                }
                offset += mapped.bits;
            }
        }
        None
    }
}
