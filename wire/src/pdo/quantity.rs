//! Numbers as codes, and the steps between codes. All steps are defined here.

/// One step of acceleration, m/s²: ±327.67 m/s² is twice what a ±16 g sensor can read.
pub const ACCELERATION_STEP: f64 = 0.01;

/// One step of angular rate, rad/s: ±40.96 rad/s holds the ±34.9 rad/s of a ±2000 °/s sensor.
pub const RATE_STEP: f64 = 0.00125;

/// One step of gyroscope bias, rad/s: ±0.32767 rad/s is ±18.8 °/s.
pub const BIAS_STEP: f64 = 0.000_01;

/// One step of a quaternion's component.
pub const UNIT_STEP: f64 = 1.0 / 32_767.0;

/// One step of temperature, °C.
pub const TEMPERATURE_STEP: f64 = 0.01;

/// Rounds to the nearest whole number, ties away from 0; saturates, and returns 0 for NaN.
fn nearest(value: f32) -> i32 {
    libm::roundf(value) as i32
}

/// A probability in 16 bits: 0 to 65535 for 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct P16(pub u16);

impl P16 {
    /// Creates the nearest code. Values outside the range are clamped: below 0 and NaN to 0, above 1 to 1.
    #[must_use]
    pub fn new(probability: f32) -> Self {
        Self(nearest(probability * 65_535.0).clamp(0, 65_535) as u16)
    }

    /// Probability, within 1/131070 of the encoded one.
    #[must_use]
    pub fn probability(self) -> f32 {
        f32::from(self.0) / 65_535.0
    }
}

/// A probability in 8 bits: 0 to 255 for 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct P8(pub u8);

impl P8 {
    /// Creates the nearest code. Values outside the range are clamped: below 0 and NaN to 0, above 1 to 1.
    #[must_use]
    pub fn new(probability: f32) -> Self {
        Self(nearest(probability * 255.0).clamp(0, 255) as u8)
    }

    /// Probability, within 1/510 of the encoded one.
    #[must_use]
    pub fn probability(self) -> f32 {
        f32::from(self.0) / 255.0
    }
}

/// Signed quantity in 16 bits: the code times a step. Codes are limited to ±32767. The code −32768 represents NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantity(pub i16);

impl Quantity {
    /// Code of NaN.
    pub const NONE: Self = Self(i16::MIN);

    /// Creates the nearest code of `value` in steps of `step`.
    #[must_use]
    pub fn new(value: f32, step: f64) -> Self {
        if value.is_nan() {
            return Self::NONE;
        }
        Self(nearest(value / step as f32).clamp(-32_767, 32_767) as i16)
    }

    /// Value; NaN if there is none. In range, it is within half a step, plus rounding errors of f32, of the encoded
    /// value.
    #[must_use]
    pub fn value(self, step: f64) -> f32 {
        if self == Self::NONE { f32::NAN } else { f32::from(self.0) * step as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probability_codes_round_trip() {
        for code in 0..=u16::MAX {
            assert_eq!(P16::new(P16(code).probability()), P16(code));
        }
        for code in 0..=u8::MAX {
            assert_eq!(P8::new(P8(code).probability()), P8(code));
        }
    }

    #[test]
    fn probabilities_are_rounded_to_the_nearest_code() {
        for i in 0..=100_000 {
            let p = i as f32 / 100_000.0;
            let error = (f64::from(P16::new(p).probability()) - f64::from(p)).abs();
            // Half a step, and the rounding errors of f32.
            assert!(error <= 0.5 / 65_535.0 + 6.0e-8, "{p} is off by {error}");
        }
    }

    #[test]
    fn probabilities_out_of_range_are_clamped_and_nan_is_zero() {
        assert_eq!(P16::new(f32::NAN), P16(0));
        assert_eq!(P16::new(-1.0), P16(0));
        assert_eq!(P16::new(f32::INFINITY), P16(u16::MAX));
        assert_eq!(P8::new(f32::NAN), P8(0));
        assert_eq!(P8::new(1.1), P8(u8::MAX));
    }

    #[test]
    fn quantities_saturate_and_keep_nan() {
        assert_eq!(Quantity::new(1.0, 0.01), Quantity(100));
        assert_eq!(Quantity::new(-1.0e9, 0.01), Quantity(-32_767));
        assert_eq!(Quantity::new(f32::INFINITY, 0.01), Quantity(32_767));
        assert!(Quantity::new(f32::NAN, 0.01).value(0.01).is_nan());
        for step in [ACCELERATION_STEP, RATE_STEP, BIAS_STEP, UNIT_STEP] {
            for code in -32_767..=32_767 {
                let quantity = Quantity(code);
                assert_eq!(Quantity::new(quantity.value(step), step), quantity);
            }
        }
    }
}
