//! Type 0x03: state of the board.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 7 | the board's clock, µs |
//! | 8 | stage: 0 starting, 1 self-test, 2 hold the foot still, 3 running, 4 recovering |
//! | 9 | NMT state, as in the heartbeat: 0 starting, 4 stopped, 5 operational, 127 pre-operational |
//! | 10 | node id; 255: none |
//! | 11 | error register (object 0x1001) |
//! | 12 to 15 | active faults: bit *i* is the fault of number *i*; a bit unknown to a reader is a fault of a newer version |
//! | 16, 17 | the sensor's temperature, 0.01 °C, signed |
//! | 18 to 61 | counters, 4 bytes each, in the order of object 0x2112 |

use estimator_core::Timestamp;

use crate::board::{COUNTERS, Counters, Stage};
use crate::bytes::{Reader, Writer};
use crate::fault::Faults;
use crate::foot::NodeId;
use crate::node::NmtState;
use crate::pdo::Quantity;

/// State of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HealthMessage {
    /// The board's clock.
    pub timestamp: Timestamp,
    /// Stage of the board.
    pub stage: Stage,
    /// The NMT state.
    pub state: NmtState,
    /// Node id, if there is one.
    pub id: Option<NodeId>,
    /// Active faults; the error register follows from them.
    pub faults: Faults,
    /// Bits of faults unknown to this version; always 0 from a board of this version.
    pub unknown_faults: u32,
    /// The sensor's temperature, 0.01 °C.
    pub temperature: Quantity,
    /// Counters.
    pub counters: Counters,
}

/// Code for "no node id".
const NO_ID: u8 = 255;

impl HealthMessage {
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.u64(self.timestamp.as_micros());
        writer.u8(self.stage.code());
        writer.u8(self.state as u8);
        writer.u8(self.id.map_or(NO_ID, NodeId::get));
        let generic = u8::from(self.unknown_faults != 0);
        writer.u8(self.faults.register() | generic);
        writer.u32(self.faults.bits() | self.unknown_faults);
        writer.i16(self.temperature.0);
        for count in self.counters.to_array() {
            writer.u32(count);
        }
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let timestamp = Timestamp::from_micros(reader.u64()?);
        let stage = Stage::from_code(reader.u8()?)?;
        let state = NmtState::from_wire(reader.u8()?).ok()?;
        let id = match reader.u8()? {
            NO_ID => None,
            id => Some(NodeId::new(id)?),
        };
        let register = reader.u8()?;
        let bits = reader.u32()?;
        let faults = Faults::from_bits(bits);
        let unknown_faults = bits & !faults.bits();
        let temperature = Quantity(reader.i16()?);
        let mut counts = [0; COUNTERS];
        for count in &mut counts {
            *count = reader.u32()?;
        }
        let message = Self {
            timestamp,
            stage,
            state,
            id,
            faults,
            unknown_faults,
            temperature,
            counters: Counters::from_array(counts),
        };
        // If the register contradicts the faults, the message has another version of this format. Unknown faults set
        // bits of their own.
        let known = if unknown_faults == 0 { register } else { register & faults.register() };
        (known == faults.register()).then_some(())?;
        reader.finish(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::uart::{Kind, Message};

    #[test]
    fn golden_bytes() {
        let message = HealthMessage {
            timestamp: Timestamp::from_micros(258),
            stage: Stage::HoldStill,
            state: NmtState::PreOperational,
            id: NodeId::new(0x12),
            faults: Faults::NONE.with(Fault::LateTick),
            unknown_faults: 0,
            temperature: Quantity(-100),
            counters: Counters::from_array([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]),
        };
        let mut payload = [0; 62];
        let mut writer = Writer::new(&mut payload);
        message.write(&mut writer);
        assert_eq!(writer.finish(), Some(62));
        assert_eq!(
            payload[..26],
            [
                2, 1, 0, 0, 0, 0, 0, 0, // time
                2, 0x7F, 0x12, 0x81, 0, 0x80, 0, 0, 0x9C, 0xFF, // state, faults, temperature
                1, 0, 0, 0, 2, 0, 0, 0,
            ]
        );
        let decoded = Message::decode(Kind::Health, &payload);
        assert_eq!(decoded, Some(Message::Health(message)));
        // A newer board's unknown fault leaves the rest readable.
        payload[15] = 0x40;
        payload[11] = 0x83;
        let newer = HealthMessage { unknown_faults: 0x4000_0000, ..message };
        let decoded = Message::decode(Kind::Health, &payload);
        assert_eq!(decoded, Some(Message::Health(newer)));
        payload[11] = 0x01;
        assert_eq!(Message::decode(Kind::Health, &payload), None, "contradicts");
        payload[15] = 0;
        payload[11] = 0x83;
        assert_eq!(Message::decode(Kind::Health, &payload), None, "contradicts");
        payload[11] = 0x81;
        payload[8] = 99;
        assert_eq!(Message::decode(Kind::Health, &payload), None);
    }
}
