//! Conversion of a foot's clock to the receiver's clock.
//!
//! A message is received after it was made, with a delay that varies but is never negative. So the least difference of
//! the two clocks is the best estimate of their offset. Clocks drift, so only the newest seconds are used.
//!
//! If a smaller difference is observed, times do not go back. They advance at half speed until it is reached, but never
//! beyond the time of reception. The same applies to times from SYNCs, whose reception varies as well.

use estimator_core::Timestamp;

/// Clock of a foot with its offset to the receiver's.
#[derive(Clone, Debug, Default)]
pub struct FootClock {
    least: Option<LeastDelay>,
    /// Last time on the foot's clock, µs; `None` if it was not known.
    made_us: Option<u64>,
    /// Last time on the receiver's clock, µs.
    time_us: Option<u64>,
}

impl FootClock {
    /// Converts the time `made` on the foot's clock, of a message received at `received`, to the receiver's clock.
    pub fn time(&mut self, made: Timestamp, received: Timestamp) -> Timestamp {
        let time_us = self.by_least_delay(made.as_micros(), received);
        self.advancing(made.as_micros(), received.as_micros(), time_us)
    }

    /// Like [`Self::time`], with the time `by_sync` known from SYNCs.
    pub fn synchronised(
        &mut self,
        made: Timestamp,
        received: Timestamp,
        by_sync: Timestamp,
    ) -> Timestamp {
        // The least delay is tracked as well, because SYNCs may end.
        self.by_least_delay(made.as_micros(), received);
        self.advancing(made.as_micros(), received.as_micros(), by_sync.as_micros())
    }

    /// Time of a message whose time on the foot's clock is unknown: the time of its reception.
    pub fn received(&mut self, received: Timestamp) -> Timestamp {
        let received_us = received.as_micros();
        let next_us = self.time_us.map_or(0, |last| last + 1);
        let time_us = received_us.max(next_us);
        (self.made_us, self.time_us) = (None, Some(time_us));
        Timestamp::from_micros(time_us)
    }

    fn by_least_delay(&mut self, made_us: u64, received: Timestamp) -> u64 {
        if self.made_us.is_some_and(|last| made_us < last) {
            // The foot has restarted: its times continue after the last one.
            (self.least, self.made_us) = (None, None);
        }
        let least = self.least.get_or_insert(LeastDelay::of(made_us, received));
        least.take(made_us, received);
        made_us.saturating_add_signed(least.offset_us())
    }

    /// Makes a time advance by at least half of the time passed on the foot's clock, but not beyond the time of
    /// reception. If the last time was beyond it, the time advances by 1 µs.
    fn advancing(&mut self, made_us: u64, received_us: u64, time_us: u64) -> Timestamp {
        let least = self.time_us.map_or(0, |last_us| {
            let passed = self.made_us.map_or(1, |last| made_us - last);
            (last_us + passed.div_ceil(2)).min(received_us).max(last_us + passed.min(1))
        });
        let time_us = time_us.max(least);
        (self.made_us, self.time_us) = (Some(made_us), Some(time_us));
        Timestamp::from_micros(time_us)
    }
}

/// Validity of a least delay, µs: clocks that are 100 ppm apart drift by 0.4 ms in it. Measured in time of
/// reception, because frames queued in a stall arrive all at once.
const KEPT_US: i64 = 4_000_000;

/// Step back from which the receiver's clock is taken to have been set, µs.
const SET_BACK_US: i64 = 1_000_000;

/// Least difference between reception and a foot's clock in the last seconds, µs. Added to a time on the foot's
/// clock, it gives the latest time at which the contact can have been made.
#[derive(Clone, Copy, Debug)]
pub struct LeastDelay {
    newest: i64,
    before: i64,
    since: Timestamp,
}

impl LeastDelay {
    /// The delay of a contact made at `made_us` on the foot's clock and received at `at`.
    #[must_use]
    pub const fn of(made_us: u64, at: Timestamp) -> Self {
        let difference = difference(made_us, at);
        Self { newest: difference, before: difference, since: at }
    }

    /// Processes the next contact.
    pub fn take(&mut self, made_us: u64, at: Timestamp) {
        let difference = difference(made_us, at);
        let kept_us = at.as_micros().wrapping_sub(self.since.as_micros()) as i64;
        if !(-SET_BACK_US..=KEPT_US).contains(&kept_us) {
            self.before = self.newest;
            self.newest = difference;
            self.since = at;
        }
        self.newest = self.newest.min(difference);
    }

    /// Offset from the foot's clock to the latest time at which a contact can have been made, µs.
    #[must_use]
    pub fn offset_us(self) -> i64 {
        self.newest.min(self.before)
    }
}

const fn difference(made_us: u64, at: Timestamp) -> i64 {
    at.as_micros().wrapping_sub(made_us) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn micros(micros: u64) -> Timestamp {
        Timestamp::from_micros(micros)
    }

    #[test]
    fn varying_delay_is_removed_and_drift_is_tracked() {
        let mut clock = FootClock::default();
        for ms in 0..60_000_u64 {
            let made = ms * 1000;
            // 50 ppm fast, delays of 0.2 to 5 ms, the shortest once every 0.1 s.
            let true_time = 7_000_000 + made + made / 20_000;
            let delay = 200 + (ms * 37 % 100) * 48;
            let time = clock.time(micros(made), micros(true_time + delay)).as_micros();
            if ms > 100 {
                let error = time.abs_diff(true_time + 200);
                assert!(error <= 420, "{error} µs at {ms} ms");
            }
        }
    }

    #[test]
    fn smaller_delay_is_applied_without_going_back() {
        let mut clock = FootClock::default();
        let mut last = 0;
        for ms in 0..200_u64 {
            // The first 20 were queued when the line was opened.
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
    fn times_exceed_reception_by_at_most_1_us_per_message() {
        let mut clock = FootClock::default();
        for ms in 0..3000_u64 {
            // The first thousand were queued and arrive at once.
            let received = 9_000_000 + 1000 * ms.max(1000);
            let time = clock.time(micros(1000 * ms), micros(received)).as_micros();
            assert!(time <= received + ms.min(1000), "{time} at {ms} ms");
            if ms > 1001 {
                assert_eq!(time, received);
            }
        }
    }

    #[test]
    fn times_after_an_unknown_one_do_not_go_back() {
        let mut clock = FootClock::default();
        clock.time(micros(1000), micros(9_000_000));
        // The message is received late. The time of the next one is known again, in another turn of the foot's clock.
        let unknown = clock.received(micros(9_004_000)).as_micros();
        let known = clock.time(micros(700_000), micros(9_701_000)).as_micros();
        assert_eq!((unknown, known), (9_004_000, 9_699_000));
        let unknown = clock.received(micros(9_704_000)).as_micros();
        let known = clock.time(micros(702_000), micros(9_704_100)).as_micros();
        assert_eq!((unknown, known), (9_704_000, 9_704_001));
    }

    #[test]
    fn restart_of_a_foot_resets_the_offset() {
        let mut clock = FootClock::default();
        clock.time(micros(5_000_000), micros(9_000_000));
        let time = clock.time(micros(1000), micros(9_500_000));
        assert_eq!(time.as_micros(), 9_500_000);
    }
}
