//! Limits of silence, and the listening time against which silent feet are detected.
//!
//! A foot is silent if nothing was received from it during the listening time. A stall of this machine delays
//! all feet, one after the other, and does not count.

use estimator_core::Timestamp;

/// Time without a contact after which a foot is reported as silent, µs.
pub const SILENT_US: u64 = 500_000;

/// Longest wait of a message of all feet for the contacts that it lacks, µs.
pub const COMPLETION_WAIT_US: u64 = 20_000;

/// Maximum time counted between two arrivals, µs; a longer gap means that the program has stalled.
const LONGEST_GAP_US: u64 = 10_000;

/// Maximum time counted for an idle poll, µs; a longer gap means that the program has stalled.
const LONGEST_WAIT_US: u64 = 50_000;

/// Accumulated listening time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Listening {
    us: u64,
    now: Option<Timestamp>,
}

impl Listening {
    /// Adds the time until data received at `at`.
    pub fn arrive(&mut self, at: Timestamp) {
        self.advance(at, LONGEST_GAP_US);
    }

    /// Adds the time until `now` without reception.
    pub fn idle(&mut self, now: Timestamp) {
        self.advance(now, LONGEST_WAIT_US);
    }

    fn advance(&mut self, time: Timestamp, longest_us: u64) {
        let before_us = self.now.unwrap_or(time).as_micros();
        let since_us = time.as_micros().saturating_sub(before_us);
        self.us += since_us.min(longest_us);
        self.now = self.now.max(Some(time));
    }

    /// Listening time, µs.
    #[must_use]
    pub const fn us(&self) -> u64 {
        self.us
    }

    /// Newest time passed in.
    #[must_use]
    pub fn now(&self) -> Timestamp {
        self.now.unwrap_or_default()
    }
}
