//! Type 0x01: the contact, at full resolution.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 7 | the sample's time, µs |
//! | 8, 9 | probability of stable contact, 0 to 65535 for 0 to 1 |
//! | 10, 11 | probability of no motion along the ground |
//! | 12, 13 | probability of no lifting, with half-widths also of no tilting |
//! | 14 to 25 | P(ax), P(ay), P(az), P(wx), P(wy), P(wz) |
//! | 26 | status, as in TPDO1 |
//! | 27 | the estimator's flags: bit 0 window not full, 1 up not known, 2 saturated, 3 stale, 4 invalid sample, 5 time gap, 6 settling, 7 unproven |

use estimator_core::{ContactEstimate, PerAxis, Probabilities, Timestamp};

use crate::bytes::{Reader, Writer};
use crate::fault::Faults;
use crate::pdo::{P16, Status};

/// Contact after one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactMessage {
    /// Acquisition time of the sample.
    pub timestamp: Timestamp,
    /// Probability of stable contact.
    pub stable: P16,
    /// Probability of no motion along the ground.
    pub tangential: P16,
    /// Probability of no lifting, with half-widths also of no tilting.
    pub vertical: P16,
    /// Probability of rest for each axis.
    pub axes: PerAxis<P16>,
    /// Phase, decision and their validity.
    pub status: Status,
    /// The estimator's flags as bits.
    pub flags: u8,
}

impl ContactMessage {
    /// Creates the message for an estimate while `faults` are active. The probabilities are 0 while a fault voids the
    /// estimate.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, faults: Faults) -> Self {
        let probabilities =
            if faults.void_estimate() { Probabilities::default() } else { estimate.probabilities };
        Self {
            timestamp: estimate.timestamp,
            stable: P16::new(probabilities.stable),
            tangential: P16::new(probabilities.tangential),
            vertical: P16::new(probabilities.vertical),
            axes: PerAxis::from_array(probabilities.axes.to_array().map(P16::new)),
            status: Status::new(estimate.decision, estimate.phase, estimate.flags, faults),
            flags: estimate.flags.bits(),
        }
    }

    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.u64(self.timestamp.as_micros());
        for code in [self.stable, self.tangential, self.vertical] {
            writer.u16(code.0);
        }
        for code in self.axes.to_array() {
            writer.u16(code.0);
        }
        writer.u8(self.status.bits());
        writer.u8(self.flags);
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let timestamp = Timestamp::from_micros(reader.u64()?);
        let mut codes = [P16(0); 9];
        for code in &mut codes {
            *code = P16(reader.u16()?);
        }
        let [stable, tangential, vertical, axes @ ..] = codes;
        let message = Self {
            timestamp,
            stable,
            tangential,
            vertical,
            axes: PerAxis::from_array(axes),
            status: Status::from_bits(reader.u8()?),
            flags: reader.u8()?,
        };
        reader.finish(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uart::{Kind, Message};
    use estimator_core::{Decision, Flag, Flags};

    #[test]
    fn golden_bytes() {
        let estimate = ContactEstimate {
            timestamp: Timestamp::from_micros(0x0102_0304_0506),
            probabilities: Probabilities {
                stable: 1.0,
                tangential: 0.2,
                vertical: 0.4,
                axes: PerAxis::from_array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
            },
            decision: Decision::Stable,
            flags: Flags::NONE.with(Flag::InvalidSample),
            ..Default::default()
        };
        let message = ContactMessage::new(&estimate, Faults::NONE);
        let mut payload = [0; 28];
        let mut writer = Writer::new(&mut payload);
        message.write(&mut writer);
        assert_eq!(writer.finish(), Some(28));
        assert_eq!(
            payload,
            [
                6, 5, 4, 3, 2, 1, 0, 0, // time
                0xFF, 0xFF, 0x33, 0x33, 0x66, 0x66, // products
                0, 0, 0x33, 0x33, 0x66, 0x66, 0x99, 0x99, 0xCC, 0xCC, 0xFF, 0xFF, // axes
                0x00, // an invalid sample: not valid, so not stable
                0x10,
            ]
        );
        let decoded = Message::decode(Kind::Contact, &payload);
        assert_eq!(decoded, Some(Message::Contact(message)));
        assert_eq!(Message::decode(Kind::Contact, &payload[1..]), None);
    }
}
