//! Alignment of the feet's clocks to the log's: a numbered SYNC reaches all nodes at the same moment.
//!
//! The log holds the time of reception of the SYNC, the foot reports the time on its own clock, both with
//! the SYNC's number. The difference is the offset to add to the foot's clock. It includes the delay of the
//! reception, which varies, so the median of several differences is used.

use std::collections::BTreeMap;

use estimator_core::Timestamp;
use wire::pdo::ClockReading;

use crate::decode::LeastDelay;

/// Number of differences in the median. At ten health frames a second they span less than two seconds, in
/// which clocks that are 50 ppm apart drift by 80 µs.
const DIFFERENCES: usize = 15;

/// Time by which a contact may undercut the least delay so far, µs.
const SOONER_US: i64 = 50_000;

/// Change of the difference that means a clock was set or restarted, µs.
const LARGEST_STEP_US: u64 = 100_000;

/// Time of reception of the newest SYNC of each number.
pub(super) type Syncs = BTreeMap<u8, Timestamp>;

/// Offset from the clock of a foot to the clock of the log.
#[derive(Clone, Debug, Default)]
pub(super) struct Alignment {
    /// Recent differences, µs, newest last.
    differences: Vec<i64>,
    /// The last SYNC that the foot reported; it reports each several times.
    newest: Option<ClockReading>,
}

impl Alignment {
    /// Processes a clock that the foot reports, which is `micros` on its counted clock, if it was read at a SYNC.
    /// `least` is the least delay of frames received live, in which case a delayed SYNC is ignored.
    pub(super) fn take(
        &mut self,
        reading: ClockReading,
        micros: u64,
        syncs: &Syncs,
        least: Option<LeastDelay>,
    ) {
        if reading.sync == 0 || self.newest == Some(reading) {
            return;
        }
        self.newest = Some(reading);
        let Some(at) = syncs.get(&reading.sync) else {
            return;
        };
        let difference = at.as_micros().wrapping_sub(micros) as i64;
        let latest = least.map(|least| least.offset_us().saturating_add(SOONER_US));
        if latest.is_some_and(|latest| difference > latest) {
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
