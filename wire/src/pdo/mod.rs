//! Process data: what a foot sends of itself, one file a frame.
//!
//! The identifiers follow the predefined connection set of CiA 301. It has four TPDOs; the other
//! three use the identifiers of RPDO2 to RPDO4, which this device does not have. Everything is
//! aligned to bytes and little-endian.

mod axes;
mod contact;
mod health;
mod load;
mod motion;
mod quantity;
mod signal;

pub use axes::Axes;
pub use contact::{Contact, Status};
pub use health::{Health, LastSync};
pub use load::Load;
pub use motion::{Acceleration, Attitude, Bias, Rate};
pub use quantity::{
    ACCELERATION_STEP, BIAS_STEP, P8, P16, Quantity, RATE_STEP, TEMPERATURE_STEP, UNIT_STEP,
};
pub use signal::{Kind, Signal};

use crate::dictionary::{Address, index};
use crate::foot::NodeId;

mod time;
pub use time::{LongTime, ShortTime, TIME_STEP_US, Unwrapper};

/// A transmit PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pdo {
    /// TPDO1: [`Contact`].
    Contact,
    /// TPDO2: [`Axes`].
    Axes,
    /// TPDO3: [`Attitude`].
    Attitude,
    /// TPDO4: [`Acceleration`].
    Acceleration,
    /// TPDO5: [`Rate`].
    Rate,
    /// TPDO6: [`Bias`].
    Bias,
    /// TPDO7: [`Health`].
    Health,
}

/// How many transmit PDOs there are.
pub const PDOS: usize = Pdo::ALL.len();

impl Pdo {
    /// All transmit PDOs, TPDO1 first.
    pub const ALL: [Self; 7] = [
        Self::Contact,
        Self::Axes,
        Self::Attitude,
        Self::Acceleration,
        Self::Rate,
        Self::Bias,
        Self::Health,
    ];

    /// The name in DBC messages, after the foot's: `FL_Contact`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Contact => "Contact",
            Self::Axes => "Axes",
            Self::Attitude => "Attitude",
            Self::Acceleration => "Acceleration",
            Self::Rate => "Rate",
            Self::Bias => "Bias",
            Self::Health => "Health",
        }
    }

    /// The function code: the identifier without the node id.
    #[must_use]
    pub const fn base(self) -> u16 {
        match self {
            Self::Contact => 0x180,
            Self::Axes => 0x280,
            Self::Attitude => 0x380,
            Self::Acceleration => 0x480,
            Self::Rate => 0x300,
            Self::Bias => 0x400,
            Self::Health => 0x500,
        }
    }

    /// The identifier of this frame of `node`.
    #[must_use]
    pub const fn cob_id(self, node: NodeId) -> u16 {
        node.cob_id(self.base())
    }

    /// Which frame of which node `id` is the identifier of.
    #[must_use]
    pub fn from_cob_id(id: u16) -> Option<(Self, NodeId)> {
        let node = NodeId::new((id & 0x7F) as u8)?;
        let pdo = Self::ALL.into_iter().find(|pdo| pdo.cob_id(node) == id)?;
        Some((pdo, node))
    }

    /// Sent every so many ms, unless set otherwise.
    #[must_use]
    pub const fn default_period_ms(self) -> u16 {
        match self {
            Self::Contact => 1,
            Self::Axes | Self::Attitude | Self::Acceleration | Self::Rate => 20,
            Self::Bias => 1000,
            Self::Health => 100,
        }
    }

    /// The objects in the frame, in their order.
    #[must_use]
    pub const fn mapping(self) -> &'static [Mapped] {
        match self {
            Self::Contact => contact::MAPPING,
            Self::Axes => axes::MAPPING,
            Self::Attitude => motion::ATTITUDE_MAPPING,
            Self::Acceleration => motion::ACCELERATION_MAPPING,
            Self::Rate => motion::RATE_MAPPING,
            Self::Bias => motion::BIAS_MAPPING,
            Self::Health => health::MAPPING,
        }
    }

    /// The frame's fields as a DBC describes them.
    #[must_use]
    pub const fn signals(self) -> &'static [Signal] {
        match self {
            Self::Contact => contact::SIGNALS,
            Self::Axes => axes::SIGNALS,
            Self::Attitude => motion::ATTITUDE_SIGNALS,
            Self::Acceleration => motion::ACCELERATION_SIGNALS,
            Self::Rate => motion::RATE_SIGNALS,
            Self::Bias => motion::BIAS_SIGNALS,
            Self::Health => health::SIGNALS,
        }
    }
}

/// An object in a PDO: an entry of its mapping parameter (0x1A00 and following).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapped {
    /// The object.
    pub address: Address,
    /// Its length in bits.
    pub bits: u8,
}

impl Mapped {
    pub(crate) const fn new(index: u16, subindex: u8, bits: u8) -> Self {
        Self {
            address: Address::new(index, subindex),
            bits,
        }
    }

    /// The entry as the mapping parameter holds it: index, sub-index, bits.
    #[must_use]
    pub const fn to_u32(self) -> u32 {
        (self.address.index as u32) << 16 | (self.address.subindex as u32) << 8 | self.bits as u32
    }
}

/// Where the sample's short timestamp stands, which most frames carry.
const TIMESTAMP: Mapped = Mapped::new(index::CONTACT, 4, 16);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foot::Foot;

    #[test]
    fn every_identifier_leads_back_to_its_frame() {
        for foot in Foot::ALL {
            for pdo in Pdo::ALL {
                let node = foot.default_node_id();
                assert_eq!(Pdo::from_cob_id(pdo.cob_id(node)), Some((pdo, node)));
            }
        }
        assert_eq!(Pdo::from_cob_id(0x180), None);
        assert_eq!(Pdo::from_cob_id(0x711), None);
        assert_eq!(Pdo::from_cob_id(0x80), None);
    }

    #[test]
    fn every_frame_is_full() {
        for pdo in Pdo::ALL {
            let bits: u32 = pdo.mapping().iter().map(|m| u32::from(m.bits)).sum();
            assert_eq!(bits, 64, "{pdo:?}");
        }
    }
}
