//! The clock of a foot on that of the receiver.
//!
//! A message is received later than it was made, by a delay that varies but is never negative: the least
//! difference of both clocks is the nearest to their offset. Clocks drift, so only the newest seconds
//! count.

use estimator_core::Timestamp;

/// How long a least difference counts, µs: clocks that are 100 ppm apart drift by 0.4 ms in it.
const KEPT_US: u64 = 4_000_000;

/// The clock of a foot, and what is to be added to it for the receiver's.
#[derive(Clone, Debug, Default)]
pub struct FootClock {
    /// The least difference since `since_us`, and the one of as long before.
    newest: Option<i64>,
    before: Option<i64>,
    since_us: u64,
    last_us: Option<u64>,
}

impl FootClock {
    /// The time on the receiver's clock at which a foot made what is of `made` on its own, and was
    /// received at `received`.
    pub fn time(&mut self, made: Timestamp, received: Timestamp) -> Timestamp {
        let made_us = made.as_micros();
        if self.last_us.is_some_and(|last| made_us < last) {
            // It has started again.
            *self = Self::default();
        }
        self.last_us = Some(made_us);
        if self.newest.is_none() {
            self.since_us = made_us;
        } else if made_us - self.since_us > KEPT_US {
            self.before = self.newest.take();
            self.since_us = made_us;
        }
        let difference = received.as_micros().wrapping_sub(made_us) as i64;
        let newest = self
            .newest
            .map_or(difference, |least| least.min(difference));
        self.newest = Some(newest);
        let offset = self.before.map_or(newest, |before| before.min(newest));
        Timestamp::from_micros(made_us.saturating_add_signed(offset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn micros(micros: u64) -> Timestamp {
        Timestamp::from_micros(micros)
    }

    #[test]
    fn delays_that_vary_are_taken_out_and_a_drift_is_followed() {
        let mut clock = FootClock::default();
        for ms in 0..60_000_u64 {
            let made = ms * 1000;
            // 50 ppm fast, and delays of 0.2 to 5 ms, the least once in a tenth of a second.
            let true_time = 7_000_000 + made + made / 20_000;
            let delay = 200 + (ms * 37 % 100) * 48;
            let time = clock
                .time(micros(made), micros(true_time + delay))
                .as_micros();
            if ms > 100 {
                let error = time.abs_diff(true_time + 200);
                assert!(error <= 420, "{error} µs at {ms} ms");
            }
        }
    }

    #[test]
    fn a_foot_that_starts_again_has_another_offset() {
        let mut clock = FootClock::default();
        clock.time(micros(5_000_000), micros(9_000_000));
        let time = clock.time(micros(1000), micros(9_500_000));
        assert_eq!(time.as_micros(), 9_500_000);
    }
}
