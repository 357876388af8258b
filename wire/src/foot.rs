//! Position of a foot on the robot, its address on the bus, and its serial number.

/// A foot of a robot with two or four legs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Foot {
    /// Front left; also the default before configuration.
    #[default]
    FrontLeft,
    /// Front right.
    FrontRight,
    /// Rear left.
    RearLeft,
    /// Rear right.
    RearRight,
    /// Left, of a biped.
    Left,
    /// Right, of a biped.
    Right,
}

impl Foot {
    /// All feet, in the order of their codes, from 1.
    pub const ALL: [Self; 6] = [
        Self::FrontLeft,
        Self::FrontRight,
        Self::RearLeft,
        Self::RearRight,
        Self::Left,
        Self::Right,
    ];

    /// The short name in DBC messages and files: `FL` … `R`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FrontLeft => "FL",
            Self::FrontRight => "FR",
            Self::RearLeft => "RL",
            Self::RearRight => "RR",
            Self::Left => "L",
            Self::Right => "R",
        }
    }

    /// The foot's code in the object dictionary, 1 to 6.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8 + 1
    }

    /// The foot with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|foot| foot.code() == code)
    }

    /// Default node id of the foot: 0x11 to 0x16.
    #[must_use]
    pub const fn default_node_id(self) -> NodeId {
        NodeId(0x10 + self.code())
    }
}

/// Identifiers of CiA 301's predefined connection set, without the node id. Those of PDOs are in [`Pdo`](crate::Pdo)
/// and [`Load`](crate::pdo::Load).
pub mod cob_id {
    /// SYNC, of the whole bus.
    pub const SYNC: u16 = 0x80;
    /// Emergency of a node.
    pub const EMERGENCY: u16 = 0x80;
    /// Time stamp, of the whole bus.
    pub const TIME: u16 = canopen_rs::time::TIME_COB_ID;
    /// Requests of a master of the layer setting services.
    pub const LSS_MASTER: u16 = canopen_rs::lss::LSS_MASTER_COB_ID;
    /// SDO responses of a node.
    pub const SDO_RESPONSE: u16 = 0x580;
    /// SDO requests to a node.
    pub const SDO_REQUEST: u16 = 0x600;
    /// Boot-up and heartbeat of a node.
    pub const HEARTBEAT: u16 = canopen_rs::nmt::HEARTBEAT_COB_BASE;

    /// Splits an identifier into the function code, as these constants have it, and the node. Frames of the whole bus
    /// have no node.
    #[must_use]
    pub const fn split(id: u16) -> (u16, Option<super::NodeId>) {
        const NODE: u16 = 0x7F;
        (id & !NODE, super::NodeId::new((id & NODE) as u8))
    }
}

/// A CANopen node id, 1 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NodeId(u8);

impl NodeId {
    /// Creates a node id; `None` if `id` is out of range.
    #[must_use]
    pub const fn new(id: u8) -> Option<Self> {
        if id >= 1 && id <= 127 { Some(Self(id)) } else { None }
    }

    /// The id as a number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }

    /// The identifier of this node's frame with the function code of `base`.
    #[must_use]
    pub const fn cob_id(self, base: u16) -> u16 {
        base + self.0 as u16
    }
}

/// Serial number of a foot, object 0x1018:4: the unique id of its chip, folded into 32 bits by FNV-1a. The foot's
/// program and its bootloader have the same number, so that a master finds the same device in both.
#[must_use]
pub fn serial_number(unique_id: impl IntoIterator<Item = u8>) -> u32 {
    const OFFSET_BASIS: u32 = 0x811C_9DC5;
    const PRIME: u32 = 0x0100_0193;
    unique_id
        .into_iter()
        .fold(OFFSET_BASIS, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(PRIME))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serial_number_is_the_published_hash_of_the_id() {
        // Test vectors of FNV-1a, 32 bits (Fowler, Noll and Vo).
        for (id, hash) in [("", 0x811C_9DC5), ("a", 0xE40C_292C), ("foobar", 0xBF9C_F968)] {
            assert_eq!(serial_number(id.bytes()), hash, "{id:?}");
        }
    }

    #[test]
    fn default_node_ids_are_0x11_to_0x16() {
        let ids = Foot::ALL.map(|foot| (foot.name(), foot.default_node_id().get()));
        assert_eq!(
            ids,
            [("FL", 0x11), ("FR", 0x12), ("RL", 0x13), ("RR", 0x14), ("L", 0x15), ("R", 0x16)]
        );
    }

    #[test]
    fn each_code_belongs_to_one_foot() {
        for foot in Foot::ALL {
            assert_eq!(Foot::from_code(foot.code()), Some(foot));
        }
        assert_eq!((Foot::from_code(0), Foot::from_code(7)), (None, None));
        assert_eq!((NodeId::new(0), NodeId::new(128)), (None, None));
    }
}
