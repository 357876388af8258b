//! Times on the foot's clock in 16 and in 32 bits, in the same steps.
//!
//! A step is 10 µs. A short time counts steps since the foot's start, modulo 2¹⁶, and wraps every 655.36 ms. To unwrap
//! it, add to the last full time the difference of the short times modulo 2¹⁶, as [`Unwrapper`] does. The result is
//! correct if at most 655.35 ms pass between two frames.

use estimator_core::Timestamp;

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
    /// The same moment in 16 bits.
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
