//! Mean period of a foot's contacts, and the least delay of their reception.

use estimator_core::Timestamp;

/// Largest number of contacts over which the period is averaged; the smallest is half of it. A single
/// period varies by a sixth, because its time is that of the sensor's edge.
const AVERAGED: u64 = 2048;

/// Validity of a least delay, µs: clocks that are 100 ppm apart drift by 0.4 ms in it. Measured in time of
/// reception, because frames queued in a stall arrive all at once.
const KEPT_US: u64 = 4_000_000;

/// Mean period of the contacts of a foot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    elapsed_us: u64,
    contacts: u64,
}

impl Pace {
    /// The pace of one contact per `period_us`.
    pub(super) const fn of(period_us: u64) -> Self {
        Self {
            elapsed_us: period_us,
            contacts: 1,
        }
    }

    /// Adds a number of contacts made within `elapsed_us`.
    pub(super) const fn take(&mut self, elapsed_us: u64, contacts: u64) {
        self.elapsed_us += elapsed_us;
        self.contacts += contacts;
        if self.contacts >= AVERAGED {
            self.elapsed_us /= 2;
            self.contacts /= 2;
        }
    }

    /// Time for a number of contacts, µs; `None` if the pace is unknown.
    pub(super) fn time_of(self, contacts: u64) -> Option<i64> {
        let time = self.elapsed_us * contacts / self.contacts.max(1);
        i64::try_from(time).ok().filter(|time| *time > 0)
    }

    /// Number of contacts made in `elapsed_us`, rounded; `None` if the pace is unknown.
    pub(super) fn contacts_in(self, elapsed_us: i64) -> Option<i64> {
        let elapsed = i128::from(elapsed_us) * i128::from(self.contacts);
        let period = i128::from(self.elapsed_us);
        let contacts = (elapsed + period / 2).checked_div_euclid(period)?;
        i64::try_from(contacts).ok()
    }
}

/// Least difference between reception and a foot's clock in the last seconds, µs. Added to a contact's time
/// on the foot's clock, it gives the latest time at which the contact can have been made.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastDelay {
    newest: i64,
    before: i64,
    since: Timestamp,
}

impl LeastDelay {
    /// The delay of a contact at `made_us` on the foot's clock, received at `at`.
    pub(super) const fn of(made_us: u64, at: Timestamp) -> Self {
        let difference = difference(made_us, at);
        Self {
            newest: difference,
            before: difference,
            since: at,
        }
    }

    /// Processes the next contact.
    pub(super) fn take(&mut self, made_us: u64, at: Timestamp) {
        let difference = difference(made_us, at);
        let kept_us = at.as_micros().wrapping_sub(self.since.as_micros());
        // Also true if the receiver's clock was set back.
        if kept_us > KEPT_US {
            self.before = self.newest;
            self.newest = difference;
            self.since = at;
        }
        self.newest = self.newest.min(difference);
    }

    /// Offset from the foot's clock to the latest time at which a contact can have been made, µs.
    pub(super) fn offset(self) -> i64 {
        self.newest.min(self.before)
    }

    /// Delay of a contact beyond the least delay, µs; negative if it is the shortest so far.
    pub(super) fn waited(self, made_us: u64, at: Timestamp) -> i64 {
        difference(made_us, at).saturating_sub(self.offset())
    }
}

const fn difference(made_us: u64, at: Timestamp) -> i64 {
    at.as_micros().wrapping_sub(made_us) as i64
}
