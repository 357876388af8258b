//! Serialisation of a window: of its ring only the samples in it, in the order of their slots.

use core::fmt;

use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeStruct as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Ring, Trailing, Window};
use crate::axis::PerAxis;
use crate::kernel::Mass;

impl<const CAPACITY: usize> Serialize for Window<Ring<CAPACITY>> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let masses = self.ring.get(..self.whole.filled).unwrap_or(&self.ring);
        let mut window = serializer.serialize_struct("Window", 3)?;
        window.serialize_field("whole", &self.whole)?;
        window.serialize_field("next", &self.next)?;
        window.serialize_field("masses", masses)?;
        window.end()
    }
}

impl<'de, const CAPACITY: usize> Deserialize<'de> for Window<Ring<CAPACITY>> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Stored {
            whole,
            next,
            masses,
        } = Stored::<CAPACITY>::deserialize(deserializer)?;
        let is_whole = (1..=CAPACITY).contains(&whole.length)
            && whole.filled <= whole.length
            && whole.filled == masses.filled
            && next < whole.length;
        if !is_whole {
            return Err(D::Error::custom("the window contradicts its length"));
        }
        Ok(Self {
            whole,
            next,
            ring: masses.ring,
        })
    }
}

/// Fields of a window.
#[derive(serde::Deserialize)]
#[serde(bound = "", rename = "Window")]
struct Stored<const CAPACITY: usize> {
    whole: Trailing,
    next: usize,
    masses: Masses<CAPACITY>,
}

/// Ring whose first slots are filled.
struct Masses<const CAPACITY: usize> {
    ring: Ring<CAPACITY>,
    filled: usize,
}

impl<'de, const CAPACITY: usize> Deserialize<'de> for Masses<CAPACITY> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Slots)
    }
}

/// Visitor of the filled slots.
struct Slots<const CAPACITY: usize>;

impl<'de, const CAPACITY: usize> Visitor<'de> for Slots<CAPACITY> {
    type Value = Masses<CAPACITY>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "masses of up to {CAPACITY} samples")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut masses = Masses {
            ring: [PerAxis::splat(Mass::ZERO); CAPACITY],
            filled: 0,
        };
        while let Some(mass) = seq.next_element()? {
            let Some(slot) = masses.ring.get_mut(masses.filled) else {
                return Err(A::Error::invalid_length(CAPACITY + 1, &self));
            };
            *slot = mass;
            masses.filled += 1;
        }
        Ok(masses)
    }
}
