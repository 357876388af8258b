//! Codes: the numbers in a frame, and the steps between them. All steps are defined here.
//!
//! A step of time is 10 µs. A [short time](ShortTime) counts steps since the foot's start, modulo 2¹⁶, and wraps every
//! 655.36 ms. To unwrap it, add to the last full time the difference of the short times modulo 2¹⁶, as [`Unwrapper`]
//! does. The result is correct if at most 655.35 ms pass between two frames.

use estimator_core::Timestamp;

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

/// One step of a short time, µs.
pub const TIME_STEP_US: u64 = 10;

/// Time of a sample in steps of 10 µs, modulo 2¹⁶.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShortTime(pub u16);

impl From<Timestamp> for ShortTime {
    fn from(timestamp: Timestamp) -> Self {
        LongTime::from(timestamp).short()
    }
}

/// Time in steps of 10 µs, modulo 2³² (almost twelve hours). Its low 16 bits are the
/// [`ShortTime`] of the same moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LongTime(pub u32);

impl LongTime {
    /// This moment in 16 bits.
    #[must_use]
    pub const fn short(self) -> ShortTime {
        ShortTime(self.0 as u16)
    }
}

impl From<Timestamp> for LongTime {
    fn from(timestamp: Timestamp) -> Self {
        Self((timestamp.as_micros() / TIME_STEP_US) as u32)
    }
}

/// Turns the short times of one foot into times that do not wrap, counted from the first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwrapper {
    last: Option<(ShortTime, u64)>,
}

impl Unwrapper {
    /// Full time, µs, of the frame with this short time; frames must be in the order of their samples.
    pub fn unwrap(&mut self, time: ShortTime) -> u64 {
        let steps = match self.last {
            None => u64::from(time.0),
            Some((last, steps)) => steps.wrapping_add(u64::from(time.0.wrapping_sub(last.0))),
        };
        self.last = Some((time, steps));
        steps.wrapping_mul(TIME_STEP_US)
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

    #[test]
    fn hours_of_ticks_are_unwrapped_to_within_a_step() {
        let mut unwrapper = Unwrapper::default();
        for tick in 0..4_000_000_u64 {
            let micros = 123 + tick * 1003;
            let full = unwrapper.unwrap(Timestamp::from_micros(micros).into());
            assert!(micros - full < TIME_STEP_US, "{micros} µs became {full}");
        }
    }

    #[test]
    fn times_count_steps_of_10_us_and_wrap() {
        const HOUR_US: u64 = 3_600_000_000;
        for (micros, long, short) in [
            (9, 0, 0),
            (10, 1, 1),
            (655_359, 65_535, 65_535),
            (655_360, 65_536, 0),
            (11 * HOUR_US, 3_960_000_000, 52_736),
            (12 * HOUR_US, 25_032_704, 63_488),
        ] {
            let time = Timestamp::from_micros(micros);
            assert_eq!(LongTime::from(time), LongTime(long), "{micros} µs");
            assert_eq!(ShortTime::from(time), ShortTime(short), "{micros} µs");
        }
    }

    #[test]
    fn gaps_of_almost_a_full_wrap_are_unwrapped() {
        let mut unwrapper = Unwrapper::default();
        unwrapper.unwrap(ShortTime(5));
        assert_eq!(unwrapper.unwrap(ShortTime(4)), (5 + 65_535) * 10);
    }
}
