//! For how long feet were listened to.
//!
//! A foot is silent when nothing came of it while it was listened to. Where this machine has stalled, all
//! feet come late, and one after the other: that is not silence.

use estimator_core::Timestamp;

/// The most that counts between two arrivals, µs: a bus of feet is never as quiet, a program that stalls is.
const LONGEST_GAP_US: u64 = 10_000;

/// The most that counts where nothing came, µs: one who listens looks more often, a program that stalls
/// does not.
const LONGEST_WAIT_US: u64 = 50_000;

/// How long was listened to feet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Listening {
    us: u64,
    now: Option<Timestamp>,
}

impl Listening {
    /// Something was received at `at`; returns the time of listening, µs.
    pub(crate) fn arrive(&mut self, at: Timestamp) -> u64 {
        self.us += self.since(at).min(LONGEST_GAP_US);
        self.now = self.now.max(Some(at));
        self.us
    }

    /// Nothing was received until `now`, though it was listened; returns the time of listening, µs.
    pub(crate) fn idle(&mut self, now: Timestamp) -> u64 {
        self.us += self.since(now).min(LONGEST_WAIT_US);
        self.now = self.now.max(Some(now));
        self.us
    }

    /// The time of listening, µs.
    pub(crate) const fn us(&self) -> u64 {
        self.us
    }

    /// The newest time that was seen.
    pub(crate) fn now(&self) -> Timestamp {
        self.now.unwrap_or_default()
    }

    fn since(&self, time: Timestamp) -> u64 {
        let now = self.now.unwrap_or(time);
        time.as_micros().saturating_sub(now.as_micros())
    }
}
