//! Row of a frame: an object of the dictionary, and the signals in its bits. The mapping, the DBC, the EDS and the
//! tables of `README.md` are generated from the rows.

use super::code::TIME_STEP_US;
use crate::address::{Address, index};
use crate::value::Value;

/// Object in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Index of the object.
    pub index: u16,
    /// Sub-index; 0 for an object of one value.
    pub subindex: u8,
    /// Name in the dictionary.
    pub name: &'static str,
    /// Zero of the object's type.
    pub zero: Value,
    /// One step, with its unit; empty if the object is not a quantity.
    pub unit: &'static str,
    /// Meaning, if not clear from its name.
    pub doc: &'static str,
    /// Signals in its bits, from the lowest.
    pub signals: &'static [Signal],
}

impl Field {
    pub(super) const fn new(
        index: u16,
        subindex: u8,
        name: &'static str,
        zero: Value,
        signals: &'static [Signal],
    ) -> Self {
        Self { index, subindex, name, zero, unit: "", doc: "", signals }
    }

    pub(super) const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    pub(super) const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = doc;
        self
    }

    /// Entry of the mapping parameter.
    const fn mapped(&self) -> Mapped {
        let bits = match self.zero.data_type().size() {
            Some(bytes) => 8 * bytes as u8,
            None => 0,
        };
        Mapped::new(self.index, self.subindex, bits)
    }
}

/// Bits of a frame as a DBC describes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name in the DBC.
    pub name: &'static str,
    /// Lowest bit in the frame; bit 8 is the lowest of byte 1. It is 0 in a [`Field`], where signals follow each other.
    pub start: u8,
    /// Length, bits.
    pub length: u8,
    /// Interpretation of the bits.
    pub kind: SignalKind,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Description.
    pub comment: &'static str,
}

impl Signal {
    pub(super) const fn probability(name: &'static str, length: u8, comment: &'static str) -> Self {
        let factor = 1.0 / ((1_u32 << length) - 1) as f64;
        Self::unsigned(name, length, factor, "", comment)
    }

    pub(super) const fn unsigned(
        name: &'static str,
        length: u8,
        factor: f64,
        unit: &'static str,
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length, kind: SignalKind::Unsigned { factor }, unit, comment }
    }

    pub(super) const fn quantity(
        name: &'static str,
        factor: f64,
        unit: &'static str,
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length: 16, kind: SignalKind::Signed { factor }, unit, comment }
    }

    pub(super) const fn named(
        name: &'static str,
        length: u8,
        names: &'static [(u8, &'static str)],
        comment: &'static str,
    ) -> Self {
        Self { name, start: 0, length, kind: SignalKind::Named(names), unit: "", comment }
    }

    pub(super) const fn flag(name: &'static str, comment: &'static str) -> Self {
        Self::named(name, 1, &[(0, "no"), (1, "yes")], comment)
    }

    /// Physical value of one step.
    #[must_use]
    pub const fn factor(&self) -> f64 {
        match self.kind {
            SignalKind::Unsigned { factor } | SignalKind::Signed { factor } => factor,
            SignalKind::Named(_) => 1.0,
        }
    }

    /// Minimum and maximum code that represent a value.
    #[must_use]
    pub const fn code_range(&self) -> (i64, i64) {
        match self.kind {
            SignalKind::Unsigned { .. } => (0, (1 << self.length) - 1),
            SignalKind::Signed { .. } => {
                (-((1 << (self.length - 1)) - 1), (1 << (self.length - 1)) - 1)
            }
            SignalKind::Named(names) => (0, names.len() as i64 - 1),
        }
    }
}

/// Interpretation of a signal's bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SignalKind {
    /// Unsigned, times `factor`.
    Unsigned {
        /// The physical value of one step.
        factor: f64,
    },
    /// Two's complement, times `factor`; the most negative code means "no value".
    Signed {
        /// The physical value of one step.
        factor: f64,
    },
    /// Unsigned, with names for its values.
    Named(&'static [(u8, &'static str)]),
}

/// An object in a PDO: an entry of its mapping parameter (0x1A00 and following).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapped {
    /// Address of the object.
    pub address: Address,
    /// Length, bits.
    pub bits: u8,
}

impl Mapped {
    pub(super) const fn new(index: u16, subindex: u8, bits: u8) -> Self {
        Self { address: Address::new(index, subindex), bits }
    }

    /// Entry as stored in the mapping parameter: index, sub-index, bits.
    #[must_use]
    pub const fn to_u32(self) -> u32 {
        (self.address.index as u32) << 16 | (self.address.subindex as u32) << 8 | self.bits as u32
    }
}

/// Mapping of a frame, the only part of its rows in the foot's flash. Only the compiler evaluates it, and it would
/// report an index out of range.
#[allow(clippy::indexing_slicing)]
pub(super) const fn mapping<const N: usize>(fields: &[Field; N]) -> [Mapped; N] {
    let mut mapping = [Mapped::new(0, 0, 0); N];
    let mut i = 0;
    while i < N {
        mapping[i] = fields[i].mapped();
        i += 1;
    }
    mapping
}

/// Signals of a frame, each with its lowest bit in the frame.
pub(super) fn signals(fields: &'static [Field]) -> impl Iterator<Item = (Field, Signal)> {
    let mut end = 0;
    fields.iter().flat_map(move |field| {
        let mut start = end;
        end += field.mapped().bits;
        field.signals.iter().map(move |signal| {
            let placed = Signal { start, ..*signal };
            start += signal.length;
            (*field, placed)
        })
    })
}

/// Short timestamp of the sample, which most frames have.
pub(super) const TIMESTAMP: Field = Field::new(
    index::CONTACT,
    4,
    "Timestamp",
    Value::U16(0),
    &[Signal::unsigned(
        "Timestamp",
        16,
        TIME_STEP_US as f64 / 1000.0,
        "ms",
        "Acquisition time of the sample on the foot's clock; wraps every 655.36 ms.",
    )],
)
.unit("10 µs")
.doc("of the sample; wraps every 655.36 ms");
