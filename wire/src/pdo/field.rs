//! Row of a frame: an object of the dictionary, and the signals in its bits. The mapping, the DBC, the
//! EDS and the tables of `README.md` are generated from the rows.

use super::{Mapped, Signal};
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
    /// Zero of its type.
    pub zero: Value,
    /// One step, with its unit; empty if it is not a quantity.
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

/// Mapping of a frame: the only part of its rows in the foot's flash. Evaluated by the compiler only,
/// which would report an index out of range.
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
