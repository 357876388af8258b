//! RPDO1: the load on the foot, sent by a robot that knows it.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 3 | load as REAL32, in the unit of the load thresholds (N) |

use estimator_core::Load as EstimatorLoad;

/// The contents of RPDO1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load(pub f32);

impl Load {
    /// Function code: the identifier without the node id.
    pub const BASE: u16 = 0x200;

    /// Encodes the frame.
    #[must_use]
    pub const fn encode(&self) -> [u8; 4] {
        self.0.to_le_bytes()
    }

    /// Decodes the frame; `None` if there are fewer than four bytes, or they are not a
    /// finite number.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let load = f32::from_le_bytes(*bytes.first_chunk()?);
        load.is_finite().then_some(Self(load))
    }
}

impl From<Load> for EstimatorLoad {
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
    fn short_frames_and_non_finite_loads_are_rejected() {
        assert_eq!(Load::decode(&[0, 0, 0xF0]), None);
        assert_eq!(Load::decode(&f32::NAN.to_le_bytes()), None);
        assert_eq!(Load::decode(&f32::INFINITY.to_le_bytes()), None);
    }
}
