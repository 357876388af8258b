//! Playback speed.

use std::fmt;
use std::str::FromStr;
use std::thread;
use std::time::Duration;

use super::LineClock;

/// Playback speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// A multiple of the original speed.
    Times(f64),
    /// As fast as possible.
    Max,
}

impl Speed {
    /// Original speed.
    pub const REAL: Self = Self::Times(1.0);

    /// Description of the expected text, for errors.
    pub const EXPECTED: &'static str = "a number from 0.001, or max,";

    /// Minimum multiple: one second takes 1000 s.
    const SLOWEST: f64 = 0.001;

    /// Creates a multiple of the original speed; `None` if it is below 0.001 or not finite.
    #[must_use]
    pub fn new(times: f64) -> Option<Self> {
        (times >= Self::SLOWEST && times.is_finite()).then_some(Self::Times(times))
    }
}

impl FromStr for Speed {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text {
            "max" => Ok(Self::Max),
            _ => text.parse().ok().and_then(Self::new).ok_or(()),
        }
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(times) => write!(f, "{times}"),
            Self::Max => f.write_str("max"),
        }
    }
}

/// Timing of a playback.
#[derive(Debug)]
pub(crate) struct Pace {
    speed: Speed,
    /// Recorded time of the start, µs, and the time of its playback.
    start: Option<(u64, Duration)>,
    clock: LineClock,
}

/// Longest wait, µs; a longer pause in a recording is skipped.
const LONGEST_PAUSE_US: u64 = 10_000_000;

impl Pace {
    pub(crate) fn new(speed: Speed) -> Self {
        Self::on(LineClock::default(), speed)
    }

    const fn on(clock: LineClock, speed: Speed) -> Self {
        let start = None;
        Self { speed, start, clock }
    }

    /// Time until data recorded at `micros` is due.
    pub(crate) fn until_due(&mut self, micros: u64) -> Duration {
        let Speed::Times(times) = self.speed else {
            return Duration::ZERO;
        };
        let now = self.clock.now();
        let (from, since) = *self.start.get_or_insert((micros, now));
        let ahead = micros.saturating_sub(from) as f64 * 1.0e-6 / times;
        let due = Duration::try_from_secs_f64(ahead).unwrap_or(Duration::MAX);
        let wait = due.saturating_sub(now.saturating_sub(since));
        if micros < from || wait > Duration::from_micros(LONGEST_PAUSE_US) {
            self.start = Some((micros, now));
            return Duration::ZERO;
        }
        wait
    }

    /// Waits until data recorded at `micros` is due, at most `longest`; returns whether it is due.
    pub(crate) fn wait(&mut self, micros: u64, longest: Duration) -> bool {
        let wait = self.until_due(micros);
        thread::sleep(wait.min(longest));
        wait <= longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_speed_halves_the_time_until_due() {
        let clock = LineClock::in_steps();
        let mut pace = Pace::on(clock.clone(), Speed::Times(2.0));
        assert_eq!(pace.until_due(5_000_000), Duration::ZERO, "the first");
        assert_eq!(pace.until_due(6_000_000), Duration::from_millis(500));
        assert!(!pace.wait(6_000_000, Duration::ZERO));
        clock.advance_to(400_000);
        assert_eq!(pace.until_due(6_000_000), Duration::from_millis(100));
        clock.advance_to(500_000);
        assert!(pace.wait(6_000_000, Duration::ZERO));
        assert_eq!(Pace::new(Speed::Max).until_due(9), Duration::ZERO);
    }

    #[test]
    fn jump_of_the_clock_does_not_delay_playback() {
        let mut pace = Pace::on(LineClock::in_steps(), Speed::REAL);
        pace.until_due(5_000_000);
        assert_eq!(pace.until_due(900_000_000_000), Duration::ZERO, "forwards");
        assert_eq!(pace.until_due(1_000_000), Duration::ZERO, "backwards");
        assert_eq!(pace.until_due(1_500_000), Duration::from_millis(500));
    }
}
