//! Least delay between a foot's clock and reception.

use estimator_core::Timestamp;

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
