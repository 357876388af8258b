//! Listening time, for the detection of silent feet.
//!
//! A foot is silent if nothing was received from it during the listening time. A stall of this machine delays
//! all feet, one after the other, and does not count.

use estimator_core::Timestamp;

/// Maximum time counted between two arrivals, µs; a longer gap means that the program has stalled.
const LONGEST_GAP_US: u64 = 10_000;

/// Maximum time counted for an idle poll, µs; a longer gap means that the program has stalled.
const LONGEST_WAIT_US: u64 = 50_000;

/// Accumulated listening time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Listening {
    us: u64,
    now: Option<Timestamp>,
}

impl Listening {
    /// Adds the time until data received at `at`; returns the listening time, µs.
    pub(crate) fn arrive(&mut self, at: Timestamp) -> u64 {
        self.us += self.since(at).min(LONGEST_GAP_US);
        self.now = self.now.max(Some(at));
        self.us
    }

    /// Adds the time until `now` without reception; returns the listening time, µs.
    pub(crate) fn idle(&mut self, now: Timestamp) -> u64 {
        self.us += self.since(now).min(LONGEST_WAIT_US);
        self.now = self.now.max(Some(now));
        self.us
    }

    /// Listening time, µs.
    pub(crate) const fn us(&self) -> u64 {
        self.us
    }

    /// Newest time passed in.
    pub(crate) fn now(&self) -> Timestamp {
        self.now.unwrap_or_default()
    }

    fn since(&self, time: Timestamp) -> u64 {
        let now = self.now.unwrap_or(time);
        time.as_micros().saturating_sub(now.as_micros())
    }
}
