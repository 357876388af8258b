//! TPDO2: the probability of each axis.

use estimator_core::{ContactEstimate, PerAxis};

use super::code::{P8, ShortTime};
use super::field::{Field, Signal, TIMESTAMP};
use crate::address::index;
use crate::fault::Faults;
use crate::value::Value;

/// The contents of TPDO2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes {
    /// Probability of rest for each axis.
    pub probabilities: PerAxis<P8>,
    /// Acquisition time of the sample.
    pub timestamp: ShortTime,
}

impl Axes {
    /// Creates the frame for an estimate while `faults` are active.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, faults: Faults) -> Self {
        let probabilities = if faults.void_estimate() {
            PerAxis::default()
        } else {
            let axes = estimate.probabilities.axes.to_array();
            PerAxis::from_array(axes.map(P8::new))
        };
        Self { probabilities, timestamp: estimate.timestamp.into() }
    }

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [ax, ay, az, wx, wy, wz] = self.probabilities.to_array().map(|p| p.0);
        let [time_low, time_high] = self.timestamp.0.to_le_bytes();
        [ax, ay, az, wx, wy, wz, time_low, time_high]
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [ax, ay, az, wx, wy, wz, time_low, time_high] = *bytes;
        Self {
            probabilities: PerAxis::from_array([ax, ay, az, wx, wy, wz].map(P8)),
            timestamp: ShortTime(u16::from_le_bytes([time_low, time_high])),
        }
    }
}

/// Field of an axis's probability.
const fn axis(subindex: u8, name: &'static str, signals: &'static [Signal]) -> Field {
    Field::new(index::AXES, subindex, name, Value::U8(0), signals).unit("1/255")
}

const fn signal(name: &'static str) -> Signal {
    Signal::probability(name, 8, "Probability that the axis rests. 0 with a fault.")
}

pub(super) const FIELDS: [Field; 7] = [
    axis(1, "P(ax)", &[signal("ProbabilityAx")]),
    axis(2, "P(ay)", &[signal("ProbabilityAy")]),
    axis(3, "P(az)", &[signal("ProbabilityAz")]),
    axis(4, "P(wx)", &[signal("ProbabilityWx")]),
    axis(5, "P(wy)", &[signal("ProbabilityWy")]),
    axis(6, "P(wz)", &[signal("ProbabilityWz")]),
    TIMESTAMP,
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
