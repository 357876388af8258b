//! A sensor's static calibration, applied where readings become SI units and nowhere else.

/// What is wrong with a sensor: a reading is its truth over `scale` plus `bias`, axis by axis in
/// the order of [`Axis::ALL`](estimator_core::Axis::ALL).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// What is read where there is nothing to read, m/s² and rad/s.
    pub bias: [f64; 6],
    /// What a reading without its bias is multiplied by.
    pub scale: [f64; 6],
}

impl Correction {
    /// A perfect sensor.
    pub const NONE: Self = Self {
        bias: [0.0; 6],
        scale: [1.0; 6],
    };

    /// The truth behind a reading, m/s² and rad/s.
    #[must_use]
    pub fn apply(&self, reading: [f64; 6]) -> [f64; 6] {
        std::array::from_fn(|axis| (reading[axis] - self.bias[axis]) * self.scale[axis])
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self::NONE
    }
}
