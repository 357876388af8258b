//! Alignment of the feet's clocks to the log's: a numbered SYNC reaches all nodes at the same moment.
//!
//! The log holds the time of reception of the SYNC, the foot reports the time on its own clock, both with
//! the SYNC's number. The difference is the offset to add to the foot's clock. It includes the delay of the
//! reception, which varies, so the median of several differences is used.

use estimator_core::Timestamp;
use wire::pdo::{LastSync, ShortTime};

use super::clock::{Elapsed, Mark};
use super::turns::Turns;

/// Number of differences in the median. At ten health frames a second they span less than two seconds, in
/// which clocks that are 50 ppm apart drift by 80 µs.
const DIFFERENCES: usize = 15;

/// Change of the difference that means a clock was set or restarted, µs.
const LARGEST_STEP_US: u64 = 100_000;

/// Time of reception of the newest SYNC of each number.
#[derive(Default)]
pub(super) struct Syncs {
    /// Ordered by reception.
    newest: Vec<(u8, Timestamp)>,
}

impl Syncs {
    /// Stores a SYNC; counter 0 means that SYNCs are not numbered.
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

/// Offset from the clock of a foot to the clock of the log.
#[derive(Clone, Debug, Default)]
pub(super) struct Alignment {
    /// Recent differences, µs, newest last.
    differences: Vec<i64>,
    /// The last SYNC that the foot reported; it repeats the report until the next SYNC.
    newest: Option<LastSync>,
}

impl Alignment {
    /// Processes the SYNC that the foot reports. `mark` is its newest contact; `live` is its clock if frames
    /// are received live, in which case a delayed SYNC is ignored.
    pub(super) fn take(&mut self, sync: LastSync, syncs: &Syncs, mark: Mark, live: Option<&Turns>) {
        if sync.counter == 0 || self.newest == Some(sync) {
            return;
        }
        self.newest = Some(sync);
        let Some(at) = syncs.at(sync.counter) else {
            return;
        };
        // Short time of the SYNC on the foot's clock; the log's clock determines the turn.
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
            // The log's clock was set, or the foot's restarted.
            self.differences.clear();
        }
        if self.differences.len() == DIFFERENCES {
            self.differences.remove(0);
        }
        self.differences.push(difference);
    }

    /// Offset to add to the foot's clock, µs, if known.
    pub(super) fn offset(&self) -> Option<i64> {
        let mut sorted = self.differences.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}
