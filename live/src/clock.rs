//! The clock of a foot on that of the receiver.
//!
//! A message is received later than it was made, by a delay that varies but is never negative: the least
//! difference of both clocks is the nearest to their offset. Clocks drift, so only the newest seconds
//! count. Where a lesser difference comes, times do not go back: they advance by half until it is reached,
//! but not beyond the time of reception. So it is where a time is known otherwise, by SYNCs, whose reception varies as well.

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
    /// The last time, on the clock of the foot and on that of the receiver.
    last: Option<(u64, u64)>,
}

impl FootClock {
    /// The time on the receiver's clock at which a foot made what is of `made` on its own, and was
    /// received at `received`.
    pub fn time(&mut self, made: Timestamp, received: Timestamp) -> Timestamp {
        let time_us = self.by_least_delay(made.as_micros(), received.as_micros());
        self.advancing(made.as_micros(), received.as_micros(), time_us)
    }

    /// The same, where SYNCs say that it was `by_sync`.
    pub fn synchronised(
        &mut self,
        made: Timestamp,
        received: Timestamp,
        by_sync: Timestamp,
    ) -> Timestamp {
        // The least delay is followed all the same: SYNCs may end.
        self.by_least_delay(made.as_micros(), received.as_micros());
        self.advancing(made.as_micros(), received.as_micros(), by_sync.as_micros())
    }

    fn by_least_delay(&mut self, made_us: u64, received_us: u64) -> u64 {
        if self.last.is_some_and(|(last, _)| made_us < last) {
            // It has started again. Its times go on after those before.
            let last = self.last.map(|(_, time)| (made_us, time + 1));
            *self = Self {
                last,
                ..Self::default()
            };
        }
        if self.newest.is_none() {
            self.since_us = made_us;
        } else if made_us - self.since_us > KEPT_US {
            self.before = self.newest.take();
            self.since_us = made_us;
        }
        let difference = received_us.wrapping_sub(made_us) as i64;
        let newest = self
            .newest
            .map_or(difference, |least| least.min(difference));
        self.newest = Some(newest);
        let offset = self.before.map_or(newest, |before| before.min(newest));
        made_us.saturating_add_signed(offset)
    }

    /// A time that is after the last by half of what has passed on the clock of the foot, at least, but not
    /// after the time of reception; where the last was, it is a microsecond after that.
    fn advancing(&mut self, made_us: u64, received_us: u64, time_us: u64) -> Timestamp {
        let least = self.last.map_or(0, |(made, time)| {
            let passed = made_us - made;
            (time + passed.div_ceil(2))
                .min(received_us)
                .max(time + passed.min(1))
        });
        let time_us = time_us.max(least);
        self.last = Some((made_us, time_us));
        Timestamp::from_micros(time_us)
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
    fn a_lesser_delay_is_taken_up_and_no_time_goes_back() {
        let mut clock = FootClock::default();
        let mut last = 0;
        for ms in 0..200_u64 {
            // The first 20 were waiting when the line was opened.
            let received = 9_000_000 + 1000 * ms.max(20);
            let time = clock.time(micros(1000 * ms), micros(received)).as_micros();
            assert!(time > last, "{time} after {last} at {ms} ms");
            last = time;
        }
        assert_eq!(last, 9_199_000);
        let early = clock.synchronised(micros(200_000), micros(9_200_000), micros(9_190_000));
        assert_eq!(early.as_micros(), 9_199_500);
        let restarted = clock.time(micros(0), micros(9_199_100)).as_micros();
        assert_eq!(restarted, 9_199_501);
    }

    #[test]
    fn no_time_is_ahead_of_reception_by_more_than_a_microsecond_each() {
        let mut clock = FootClock::default();
        for ms in 0..3000_u64 {
            // The first thousand were waiting, and came all at once.
            let received = 9_000_000 + 1000 * ms.max(1000);
            let time = clock.time(micros(1000 * ms), micros(received)).as_micros();
            assert!(time <= received + ms.min(1000), "{time} at {ms} ms");
            if ms > 1001 {
                assert_eq!(time, received);
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
