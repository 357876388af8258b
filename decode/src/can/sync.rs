//! The clocks of all feet and the log's as one: a numbered SYNC reaches all at the same moment.
//!
//! The log has the time at which it received the SYNC, a foot reports the time of its own clock, both
//! with the SYNC's number. The difference is what is to be added to the foot's clock. It contains the
//! delay of the reception, which differs from SYNC to SYNC, so the median of some is used.

use estimator_core::Timestamp;
use wire::pdo::{LastSync, ShortTime};

use super::clock::{Elapsed, Mark};
use super::turns::Turns;

/// The number of differences whose median counts: at ten health frames a second, less than two seconds,
/// in which clocks that are 50 ppm apart drift by 80 µs.
const DIFFERENCES: usize = 15;

/// Differences that are further apart are not of the same clocks, µs.
const LARGEST_STEP_US: u64 = 100_000;

/// When the log received the newest SYNC of each number.
#[derive(Default)]
pub(super) struct Syncs {
    /// In the order of reception.
    newest: Vec<(u8, Timestamp)>,
}

impl Syncs {
    /// Notes a SYNC; a counter of 0 means that SYNCs are not numbered.
    pub(super) fn take(&mut self, counter: u8, at: Timestamp) {
        self.newest.retain(|(known, _)| *known != counter);
        if counter != 0 {
            self.newest.push((counter, at));
        }
    }

    fn at(&self, counter: u8) -> Option<Timestamp> {
        let found = self.newest.iter().rfind(|(known, _)| *known == counter);
        found.map(|(_, at)| *at)
    }
}

/// What is to be added to the clock of a foot for that of the log.
#[derive(Clone, Debug, Default)]
pub(super) struct Alignment {
    /// The newest differences, µs, the newest last.
    differences: Vec<i64>,
    /// The SYNC that the foot reported last: it says the same one again until the next has come.
    newest: Option<LastSync>,
}

impl Alignment {
    /// Takes in the SYNC that the foot reports; `mark` is its newest contact, `live` its clock where frames
    /// come live: then a SYNC that has waited says nothing.
    pub(super) fn take(&mut self, sync: LastSync, syncs: &Syncs, mark: Mark, live: Option<&Turns>) {
        if sync.counter == 0 || self.newest == Some(sync) {
            return;
        }
        self.newest = Some(sync);
        let Some(at) = syncs.at(sync.counter) else {
            return;
        };
        // The short time of the foot's clock at the SYNC; which turn, the log's clock decides.
        let short = ShortTime(sync.time.0 as u16);
        let by_log = || match mark.elapsed(short, Some(at)) {
            Elapsed::Agreed(elapsed) => mark.micros.checked_add_signed(elapsed),
            _ => None,
        };
        let long = live.and_then(|turns| turns.counted(sync));
        let Some(clock) = long.or_else(by_log) else {
            return;
        };
        let difference = at.as_micros().wrapping_sub(clock) as i64;
        if live.is_some_and(|turns| turns.has_waited(difference)) {
            return;
        }
        if let Some(known) = self.offset()
            && known.abs_diff(difference) > LARGEST_STEP_US
        {
            // The log's clock was set, or the foot's began again.
            self.differences.clear();
        }
        if self.differences.len() == DIFFERENCES {
            self.differences.remove(0);
        }
        self.differences.push(difference);
    }

    /// What is to be added, µs, where that is known.
    pub(super) fn offset(&self) -> Option<i64> {
        let mut sorted = self.differences.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}
