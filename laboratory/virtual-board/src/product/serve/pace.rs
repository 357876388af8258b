//! Keeps virtual time at the speed of real time, and counts the loss if it cannot.

use std::thread;
use std::time::{Duration, Instant};

/// Maximum delay that is caught up; a longer one is lost, and time continues from there.
const CAUGHT_UP: Duration = Duration::from_millis(50);

/// Minimum interval between reports of a loss.
const REPORTED_EVERY: Duration = Duration::from_secs(5);

/// Minimum speed: a millisecond of the boards takes a second.
const SLOWEST: f64 = 0.001;

/// The speed of virtual time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VirtualSpeed {
    /// A multiple of real time.
    Times(f64),
    /// As fast as possible.
    Max,
}

impl core::str::FromStr for VirtualSpeed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let times = text.parse().ok();
        times
            .filter(|times: &f64| *times >= SLOWEST && times.is_finite())
            .map(Self::Times)
            .ok_or_else(|| format!("write a number from {SLOWEST}, or max"))
    }
}

/// Pace of a run.
#[derive(Debug)]
pub struct Pace {
    speed: VirtualSpeed,
    began: Instant,
    /// Real time of virtual time 0, shifted by the losses.
    zero: Instant,
    /// Real time lost: it passed while virtual time stood still.
    pub(crate) lost: Duration,
    reported: (Instant, Duration),
}

impl Pace {
    /// Starts virtual time now.
    #[must_use]
    pub fn new(speed: VirtualSpeed) -> Self {
        let now = Instant::now();
        Self { speed, began: now, zero: now, lost: Duration::ZERO, reported: (now, Duration::ZERO) }
    }

    /// Waits until a virtual time, ms, is due.
    pub fn wait(&mut self, ms: u64) {
        thread::sleep(self.until_due(ms, Instant::now()));
    }

    /// Time from `now` until a virtual time, ms, is due; a long delay is lost.
    fn until_due(&mut self, ms: u64, now: Instant) -> Duration {
        let VirtualSpeed::Times(times) = self.speed else {
            return Duration::ZERO;
        };
        let due = self.zero + Duration::from_secs_f64(ms as f64 * 1.0e-3 / times);
        let delay = now.saturating_duration_since(due);
        if delay > CAUGHT_UP {
            self.lost += delay;
            self.zero += delay;
        }
        due.saturating_duration_since(now)
    }

    /// Total loss, if it has grown since the last report and the interval between reports has passed.
    pub fn report(&mut self) -> Option<Duration> {
        let (when, what) = self.reported;
        if self.lost == what || when.elapsed() < REPORTED_EVERY {
            return None;
        }
        self.reported = (Instant::now(), self.lost);
        Some(self.lost)
    }

    /// Real time since the start.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_time_follows_real_time_and_long_delays_are_lost() {
        let mut pace = Pace::new(VirtualSpeed::Times(2.0));
        let (zero, ms) = (pace.zero, Duration::from_millis);
        assert_eq!(pace.until_due(40, zero), ms(20));
        assert_eq!(pace.until_due(40, zero + ms(70)), ms(0));
        assert_eq!(pace.lost, ms(0), "it is caught up");
        assert_eq!(pace.until_due(40, zero + ms(220)), ms(0));
        assert_eq!(pace.lost, ms(200));
        assert_eq!(pace.until_due(42, zero + ms(220)), ms(1), "it goes on from there");
        assert_eq!(pace.lost, ms(200));
    }

    #[test]
    fn a_speed_is_a_number_above_0_or_max() {
        assert_eq!("max".parse(), Ok(VirtualSpeed::Max));
        assert_eq!("0.5".parse(), Ok(VirtualSpeed::Times(0.5)));
        for text in ["0", "-1", "fast", "inf", "nan"] {
            assert!(text.parse::<VirtualSpeed>().is_err(), "{text}");
        }
    }
}
