//! Clock of a line.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use estimator_core::Timestamp;

use crate::robot::board;

/// Clock of a line: that of this machine, or one in steps, such as that of boards in lock step. A clock in steps stands
/// still between two [`advance_to`](LineClock::advance_to). Clones show the same time.
#[derive(Clone, Debug, Default)]
pub struct LineClock(Option<Arc<AtomicU64>>);

impl LineClock {
    /// Creates a clock in steps, at time 0.
    #[must_use]
    pub fn in_steps() -> Self {
        Self(Some(Arc::default()))
    }

    /// Returns whether the clock stands still between steps.
    #[must_use]
    pub const fn is_in_steps(&self) -> bool {
        self.0.is_some()
    }

    /// Advances a clock in steps to this time, µs; the clock of this machine and a later time are unchanged.
    pub fn advance_to(&self, us: u64) {
        if let Some(now_us) = &self.0 {
            now_us.fetch_max(us, Ordering::Relaxed);
        }
    }

    /// Time since an arbitrary beginning.
    #[must_use]
    pub fn now(&self) -> Duration {
        static BEGINNING: OnceLock<Instant> = OnceLock::new();
        match &self.0 {
            Some(us) => Duration::from_micros(us.load(Ordering::Relaxed)),
            None => BEGINNING.get_or_init(Instant::now).elapsed(),
        }
    }

    /// Time until `end`; 0 if it has passed.
    #[must_use]
    pub fn until(&self, end: Duration) -> Duration {
        end.saturating_sub(self.now())
    }

    /// Time of an arrival, µs since 1970. A clock in steps begins with 2021.
    #[must_use]
    pub fn stamp(&self) -> Timestamp {
        let us = |time: Duration| u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        match &self.0 {
            Some(_) => board::in_logs(Timestamp::from_micros(us(self.now()))),
            None => {
                let since = SystemTime::now().duration_since(UNIX_EPOCH);
                Timestamp::from_micros(us(since.unwrap_or_default()))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_in_steps_stands_still_between_them() {
        let clock = LineClock::in_steps();
        let same = clock.clone();
        let end = clock.now() + Duration::from_millis(3);
        clock.advance_to(2_000);
        clock.advance_to(1_000);
        assert_eq!(same.now(), Duration::from_millis(2));
        assert_eq!(same.until(end), Duration::from_millis(1));
        let before = same.stamp().as_micros();
        clock.advance_to(5_000);
        assert_eq!(same.stamp().as_micros() - before, 3_000);
        assert_eq!(same.until(end), Duration::ZERO);
    }
}
