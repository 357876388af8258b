//! How fast a foot sends contacts, and how soon they are received at best.

use estimator_core::Timestamp;

/// Contacts over which the time from one to the next is averaged, at most; half of them at least. A
/// single one varies by a sixth, as its time is that of the sensor's edge.
const AVERAGED: u64 = 2048;

/// How long a least delay counts, µs: clocks that are 100 ppm apart drift by 0.4 ms in it. By the time
/// of reception: what waited in a stall comes all at once.
const KEPT_US: u64 = 4_000_000;

/// The mean time from one contact of a foot to its next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    elapsed_us: u64,
    contacts: u64,
}

impl Pace {
    /// The pace of one contact in this time, µs.
    pub(super) const fn of(period_us: u64) -> Self {
        Self {
            elapsed_us: period_us,
            contacts: 1,
        }
    }

    /// Takes in the number of contacts that were made in a time, µs.
    pub(super) const fn take(&mut self, elapsed_us: u64, contacts: u64) {
        self.elapsed_us += elapsed_us;
        self.contacts += contacts;
        if self.contacts >= AVERAGED {
            self.elapsed_us /= 2;
            self.contacts /= 2;
        }
    }

    /// The time in which a number of contacts is made, µs; `None` where the pace is not known.
    pub(super) fn time_of(self, contacts: u64) -> Option<i64> {
        let time = self.elapsed_us * contacts / self.contacts.max(1);
        i64::try_from(time).ok().filter(|time| *time > 0)
    }

    /// How many contacts are made in this time, µs, to the nearest.
    pub(super) fn contacts_in(self, elapsed_us: i64) -> Option<i64> {
        let elapsed = i128::from(elapsed_us) * i128::from(self.contacts);
        let period = i128::from(self.elapsed_us);
        let contacts = (elapsed + period / 2).checked_div_euclid(period)?;
        i64::try_from(contacts).ok()
    }
}

/// The least difference of reception and a foot's clock in the newest seconds, µs: no contact was made
/// later than its foot's clock and this say.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastDelay {
    newest: i64,
    before: i64,
    since: Timestamp,
}

impl LeastDelay {
    /// Of a contact of `made_us` on the foot's clock that was received at `at`.
    pub(super) const fn of(made_us: u64, at: Timestamp) -> Self {
        let difference = difference(made_us, at);
        Self {
            newest: difference,
            before: difference,
            since: at,
        }
    }

    /// Takes in the next contact.
    pub(super) fn take(&mut self, made_us: u64, at: Timestamp) {
        let difference = difference(made_us, at);
        let kept_us = at.as_micros().wrapping_sub(self.since.as_micros());
        // Also where the receiver's clock was set back.
        if kept_us > KEPT_US {
            self.before = self.newest;
            self.newest = difference;
            self.since = at;
        }
        self.newest = self.newest.min(difference);
    }

    /// What is to be added to the foot's clock for the latest time at which a contact can have been
    /// made, µs.
    pub(super) fn offset(self) -> i64 {
        self.newest.min(self.before)
    }

    /// How long a contact waited beyond the least delay, µs; negative where it was sooner than any.
    pub(super) fn waited(self, made_us: u64, at: Timestamp) -> i64 {
        difference(made_us, at).saturating_sub(self.offset())
    }
}

const fn difference(made_us: u64, at: Timestamp) -> i64 {
    at.as_micros().wrapping_sub(made_us) as i64
}
