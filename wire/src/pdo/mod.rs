//! Process data: the frames that a foot sends. Each frame has a file, and each field a row with its object, mapping,
//! signals and text. [`Pdo`] is the table of the frames. `Snapshot` has the inputs of all frames in one tick, besides the estimate.
//!
//! The identifiers follow the predefined connection set of CiA 301, which has four TPDOs. The other three frames use
//! the identifiers of RPDO2 to RPDO4, which this device does not have. Everything is aligned to bytes and
//! little-endian.

mod axes;
mod code;
mod contact;
mod field;
mod health;
mod load;
mod motion;

pub use axes::Axes;
pub use code::{
    ACCELERATION_STEP, BIAS_STEP, LongTime, P8, P16, Quantity, RATE_STEP, ShortTime,
    TEMPERATURE_STEP, TIME_STEP_US, UNIT_STEP, Unwrapper,
};
pub use contact::{Contact, Status};
pub use field::{Field, Mapped, Signal, SignalKind};
pub use health::{ClockReading, Health};
pub use load::Load;
pub use motion::{Acceleration, Attitude, Bias, Rate};

use estimator_core::ContactEstimate;

use crate::address::Address;
use crate::fault::Faults;
use crate::foot::{NodeId, cob_id};

/// Defines the enumeration and the properties of each frame, from one row per frame: its name, function code,
/// period in ms, rows, title and comment.
macro_rules! pdos {
    ($($(#[$doc:meta])* $variant:ident = $base:literal, $period:literal ms, $fields:path, $title:literal, $about:literal;)*) => {
        /// A transmit PDO.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Pdo {
            $($(#[$doc])* $variant,)*
        }

        impl Pdo {
            /// All transmit PDOs, TPDO1 first.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] = [$(Self::$variant),*];

            /// Name in DBC messages, after the foot's: `FL_Contact`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($variant),)*
                }
            }

            /// Function code: the identifier without the node id.
            #[must_use]
            pub const fn base(self) -> u16 {
                match self {
                    $(Self::$variant => $base,)*
                }
            }

            /// Default period, ms.
            #[must_use]
            pub const fn default_period_ms(self) -> u16 {
                match self {
                    $(Self::$variant => $period,)*
                }
            }

            /// Title in the dictionary.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self {
                    $(Self::$variant => $title,)*
                }
            }

            /// Comment in the DBC.
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self {
                    $(Self::$variant => $about,)*
                }
            }

            /// Rows of the frame, in order.
            #[must_use]
            pub const fn fields(self) -> &'static [Field] {
                match self {
                    $(Self::$variant => &$fields,)*
                }
            }

            /// Objects in the frame, in order.
            #[must_use]
            pub const fn mapping(self) -> &'static [Mapped] {
                match self {
                    $(Self::$variant => const { &field::mapping(&$fields) },)*
                }
            }
        }
    };
}

pdos! {
    /// TPDO1: [`Contact`].
    Contact = 0x180, 1 ms, contact::FIELDS, "contact", "contact, each tick.";
    /// TPDO2: [`Axes`].
    Axes = 0x280, 20 ms, axes::FIELDS, "axes", "probability of each axis.";
    /// TPDO3: [`Attitude`].
    Attitude = 0x380, 20 ms, motion::ATTITUDE, "attitude", "orientation.";
    /// TPDO4: [`Acceleration`].
    Acceleration = 0x480, 20 ms, motion::ACCELERATION, "acceleration", "acceleration without gravity.";
    /// TPDO5: [`Rate`].
    Rate = 0x300, 20 ms, motion::RATE, "rate", "angular rate without bias.";
    /// TPDO6: [`Bias`].
    Bias = 0x400, 1000 ms, motion::BIAS, "bias and temperature", "gyroscope bias and temperature.";
    /// TPDO7: [`Health`].
    Health = 0x500, 100 ms, health::FIELDS, "health", "flags, errors, drops and the clock.";
}

/// Number of transmit PDOs.
pub const PDOS: usize = Pdo::ALL.len();

impl Pdo {
    /// Identifier of this frame of `node`.
    #[must_use]
    pub const fn cob_id(self, node: NodeId) -> u16 {
        node.cob_id(self.base())
    }

    /// Frame and node with the identifier `id`.
    #[must_use]
    pub fn from_cob_id(id: u16) -> Option<(Self, NodeId)> {
        let (function, node) = cob_id::split(id);
        let pdo = Self::ALL.into_iter().find(|pdo| pdo.base() == function)?;
        Some((pdo, node?))
    }

    /// Signals of the frame as a DBC describes them, each with the row that it belongs to.
    pub fn signals(self) -> impl Iterator<Item = (Field, Signal)> {
        field::signals(self.fields())
    }
}

/// Inputs of all process data in one tick, besides the estimate. Most frames are due on few ticks. So a frame is built
/// when it is due or when one of its objects is read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    /// Whether there was a tick.
    pub(crate) is_taken: bool,
    /// Temperature of the sensor, °C.
    pub(crate) temperature: f32,
    pub(crate) faults: Faults,
    /// Frames dropped since the start.
    pub(crate) dropped: u32,
    pub(crate) last_sync: ClockReading,
    /// Sequence number of the contact.
    pub(crate) sequence: u8,
}

impl Snapshot {
    /// Encodes a frame. `estimate` is the estimate of the tick.
    pub(crate) fn payload(&self, pdo: Pdo, estimate: &ContactEstimate) -> [u8; 8] {
        let faults = self.faults;
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
    pub(crate) fn value(&self, address: Address, estimate: &ContactEstimate) -> Option<u32> {
        for pdo in Pdo::ALL {
            let mut offset = 0;
            for mapped in pdo.mapping() {
                if mapped.address == address {
                    let payload = if self.is_taken { self.payload(pdo, estimate) } else { [0; 8] };
                    return Some((u64::from_le_bytes(payload) >> offset) as u32);
                }
                offset += mapped.bits;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foot::Foot;

    #[test]
    fn every_identifier_maps_to_its_frame() {
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
    fn signals_fill_their_fields() {
        for pdo in Pdo::ALL {
            for field in pdo.fields() {
                let bits = 8 * field.zero.data_type().size().expect("a number");
                let used: u8 = field.signals.iter().map(|signal| signal.length).sum();
                assert_eq!(usize::from(used), bits, "{}", field.name);
            }
        }
    }

    #[test]
    fn every_frame_is_full() {
        for pdo in Pdo::ALL {
            let bits: u32 = pdo.mapping().iter().map(|m| u32::from(m.bits)).sum();
            assert_eq!(bits, 64, "{pdo:?}");
        }
    }
}
