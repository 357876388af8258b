//! RPDO1: the load on the foot, from a robot that knows it.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 3 | load as REAL32, in the unit of the load thresholds (N) |

use estimator_core::phase;

/// The contents of RPDO1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load(pub f32);

impl Load {
    /// The function code: the identifier without the node id.
    pub const BASE: u16 = 0x200;

    /// The frame's bytes.
    #[must_use]
    pub const fn encode(&self) -> [u8; 4] {
        self.0.to_le_bytes()
    }

    /// The frame with these bytes: `None` where there are fewer than four, or they are not a
    /// finite number.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let load = f32::from_le_bytes(*bytes.first_chunk()?);
        load.is_finite().then_some(Self(load))
    }
}

impl From<Load> for phase::Load {
    fn from(load: Load) -> Self {
        Self(load.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        assert_eq!(Load(120.0).encode(), [0, 0, 0xF0, 0x42]);
        assert_eq!(Load::decode(&[0, 0, 0xF0, 0x42, 9]), Some(Load(120.0)));
    }

    #[test]
    fn what_is_not_a_load_is_refused() {
        assert_eq!(Load::decode(&[0, 0, 0xF0]), None);
        assert_eq!(Load::decode(&f32::NAN.to_le_bytes()), None);
        assert_eq!(Load::decode(&f32::INFINITY.to_le_bytes()), None);
    }
}
