//! Clock of a line, and the pace at which a playback follows it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use estimator_core::Timestamp;

use crate::source::Speed;

/// Beginning of 2021, µs since 1970.
const YEAR_2021_US: u64 = 1_609_459_200_000_000;

/// Converts a time of a simulated clock, which begins with 2021, to one since 1970: logs need a date.
#[must_use]
pub const fn since_2021(time: Timestamp) -> Timestamp {
    Timestamp::from_micros(YEAR_2021_US + time.as_micros())
}

/// Clock of a line: the clock of this machine, or a clock in steps, as of boards in lock step. A clock in steps
/// only advances by [`advance_to`](LineClock::advance_to). Clones show the same time.
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
            Some(_) => since_2021(Timestamp::from_micros(us(self.now()))),
            None => {
                let since = SystemTime::now().duration_since(UNIX_EPOCH);
                Timestamp::from_micros(us(since.unwrap_or_default()))
            }
        }
    }
}

/// Timing of a playback.
#[derive(Debug)]
pub struct PlaybackPace {
    speed: Speed,
    /// Recorded time of the start, µs, and the time of its playback.
    start: Option<(u64, Duration)>,
    clock: LineClock,
}

/// Longest pause of a recording that is played, µs of recorded time; a longer one is skipped.
const LONGEST_PAUSE_US: f64 = 10_000_000.0;

impl PlaybackPace {
    /// Creates the timing of a playback at this speed, on the clock of this machine.
    #[must_use]
    pub fn new(speed: Speed) -> Self {
        Self::on(LineClock::default(), speed)
    }

    const fn on(clock: LineClock, speed: Speed) -> Self {
        let start = None;
        Self { speed, start, clock }
    }

    /// Time until data recorded at `micros` is due.
    pub fn until_due(&mut self, micros: u64) -> Duration {
        let Speed::Times(times) = self.speed else {
            return Duration::ZERO;
        };
        let now = self.clock.now();
        let (from, since) = *self.start.get_or_insert((micros, now));
        let ahead = micros.saturating_sub(from) as f64 * 1.0e-6 / times;
        let due = Duration::try_from_secs_f64(ahead).unwrap_or(Duration::MAX);
        let wait = due.saturating_sub(now.saturating_sub(since));
        let recorded_us = wait.as_secs_f64() * times * 1.0e6;
        if micros < from || recorded_us > LONGEST_PAUSE_US {
            self.start = Some((micros, now));
            return Duration::ZERO;
        }
        wait
    }

    /// Waits until data recorded at `micros` is due, at most `longest`; returns whether it is due.
    pub fn wait(&mut self, micros: u64, longest: Duration) -> bool {
        let wait = self.until_due(micros);
        thread::sleep(wait.min(longest));
        wait <= longest
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

    #[test]
    fn double_speed_halves_the_time_until_due() {
        let clock = LineClock::in_steps();
        let mut pace = PlaybackPace::on(clock.clone(), Speed::Times(2.0));
        assert_eq!(pace.until_due(5_000_000), Duration::ZERO, "the first");
        assert_eq!(pace.until_due(6_000_000), Duration::from_millis(500));
        assert!(!pace.wait(6_000_000, Duration::ZERO));
        clock.advance_to(400_000);
        assert_eq!(pace.until_due(6_000_000), Duration::from_millis(100));
        clock.advance_to(500_000);
        assert!(pace.wait(6_000_000, Duration::ZERO));
        assert_eq!(PlaybackPace::new(Speed::Max).until_due(9), Duration::ZERO);
    }

    #[test]
    fn slow_playback_keeps_its_pace() {
        let mut pace = PlaybackPace::on(LineClock::in_steps(), Speed::Times(0.001));
        pace.until_due(5_000_000);
        // A period at 50 Hz lasts longer than the longest pause.
        assert_eq!(pace.until_due(5_020_000), Duration::from_secs(20));
        let mut pace = PlaybackPace::on(LineClock::in_steps(), Speed::Times(10.0));
        pace.until_due(5_000_000);
        assert_eq!(pace.until_due(25_000_000), Duration::ZERO, "a pause of 20 s");
    }

    #[test]
    fn jump_of_the_clock_does_not_delay_playback() {
        let mut pace = PlaybackPace::on(LineClock::in_steps(), Speed::REAL);
        pace.until_due(5_000_000);
        assert_eq!(pace.until_due(900_000_000_000), Duration::ZERO, "forwards");
        assert_eq!(pace.until_due(1_000_000), Duration::ZERO, "backwards");
        assert_eq!(pace.until_due(1_500_000), Duration::from_millis(500));
    }
}
