//! TPDO2: the probability of each axis.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 5 | P(ax), P(ay), P(az), P(wx), P(wy), P(wz), each 0 to 255 for 0 to 1 |
//! | 6, 7 | the sample's time, 10 µs, modulo 2¹⁶ |

use estimator_core::{ContactEstimate, PerAxis};

use super::{Mapped, P8, ShortTime, Signal, TIMESTAMP};
use crate::dictionary::index;
use crate::fault::Faults;

/// The contents of TPDO2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes {
    /// Probability per axis that it rests.
    pub probabilities: PerAxis<P8>,
    /// When the sample was acquired.
    pub timestamp: ShortTime,
}

impl Axes {
    /// The frame for an estimate while `faults` last.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, faults: Faults) -> Self {
        let probabilities = if faults.void_estimate() {
            PerAxis::default()
        } else {
            let axes = estimate.probabilities.axes.to_array();
            PerAxis::from_array(axes.map(P8::new))
        };
        Self {
            probabilities,
            timestamp: estimate.timestamp.into(),
        }
    }

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [ax, ay, az, wx, wy, wz] = self.probabilities.to_array().map(|p| p.0);
        let [time_low, time_high] = self.timestamp.0.to_le_bytes();
        [ax, ay, az, wx, wy, wz, time_low, time_high]
    }

    /// The frame with these bytes, whatever they are.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [ax, ay, az, wx, wy, wz, time_low, time_high] = *bytes;
        Self {
            probabilities: PerAxis::from_array([ax, ay, az, wx, wy, wz].map(P8)),
            timestamp: ShortTime(u16::from_le_bytes([time_low, time_high])),
        }
    }
}

pub(super) const MAPPING: &[Mapped] = &[
    Mapped::new(index::AXES, 1, 8),
    Mapped::new(index::AXES, 2, 8),
    Mapped::new(index::AXES, 3, 8),
    Mapped::new(index::AXES, 4, 8),
    Mapped::new(index::AXES, 5, 8),
    Mapped::new(index::AXES, 6, 8),
    TIMESTAMP,
];

const COMMENT: &str = "Probability that the axis rests. 0 with a fault.";

pub(super) const SIGNALS: &[Signal] = &[
    Signal::probability("ProbabilityAx", 0, 8, COMMENT),
    Signal::probability("ProbabilityAy", 8, 8, COMMENT),
    Signal::probability("ProbabilityAz", 16, 8, COMMENT),
    Signal::probability("ProbabilityWx", 24, 8, COMMENT),
    Signal::probability("ProbabilityWy", 32, 8, COMMENT),
    Signal::probability("ProbabilityWz", 40, 8, COMMENT),
    Signal::timestamp(48),
];

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Probabilities, Timestamp};

    #[test]
    fn golden_bytes() {
        let estimate = ContactEstimate {
            timestamp: Timestamp::from_micros(20),
            probabilities: Probabilities {
                axes: PerAxis::from_array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
                ..Default::default()
            },
            ..Default::default()
        };
        let axes = Axes::new(&estimate, Faults::NONE);
        assert_eq!(axes.encode(), [0, 51, 102, 153, 204, 255, 2, 0]);
        assert_eq!(Axes::decode(&axes.encode()), axes);
    }
}
