//! A row of a frame: an object of the dictionary, and the signals that its bits hold. Mapping, DBC,
//! EDS and the tables of `README.md` are made of the rows.

use super::{Mapped, Signal};
use crate::value::Value;

/// An object in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// The object's index.
    pub index: u16,
    /// Its part; 0 for an object of one value.
    pub subindex: u8,
    /// Its name in the dictionary.
    pub name: &'static str,
    /// A zero of its type.
    pub zero: Value,
    /// One step, with its unit; empty where it is no quantity.
    pub unit: &'static str,
    /// What it means, where its name does not say it all.
    pub doc: &'static str,
    /// What its bits hold, from the lowest.
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
        Self {
            index,
            subindex,
            name,
            zero,
            unit: "",
            doc: "",
            signals,
        }
    }

    pub(super) const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    pub(super) const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = doc;
        self
    }

    /// The entry of the mapping parameter.
    const fn mapped(&self) -> Mapped {
        let bits = match self.zero.data_type().size() {
            Some(bytes) => 8 * bytes as u8,
            None => 0,
        };
        Mapped::new(self.index, self.subindex, bits)
    }
}

/// The mapping of a frame: all that the foot's flash holds of its rows. Evaluated by the compiler only,
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

/// The signals of a frame, each with its lowest bit in the frame.
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
