//! The long clock of a foot, which its health frames report with the last SYNC.
//!
//! A health frame holds the time of the last SYNC in 32 bits; its contact holds its own time in 16 bits. A
//! SYNC that was not reported before arrived after the previous health frame: if that was less than a turn
//! of the short clock ago, both times together give the contact's time in 32 bits.
//!
//! Without SYNCs there is no long time, and the number of turns is unknown. The same applies until a foot
//! has reported two SYNCs, and if health frames or SYNCs are less frequent than turns of the short clock:
//! more turns may then be missing than are detected. A foot that was silent for more than six hours is
//! taken to have restarted, because half of the long clock's range has passed.

use wire::pdo::{LastSync, ShortTime, TIME_STEP_US};

use super::clock::{OVERTAKEN_US, STEP_US, TURN_US};

/// Result of checking the counted turns against a health frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Inconclusive: the SYNC was reported before or may be old.
    Unknown,
    /// The count is right.
    Right,
    /// Number of turns that were not counted; negative if too many were counted.
    Off(i64),
    /// The foot's clock has restarted.
    Restarted,
}

/// A SYNC reported by a foot, with the time of the contact on the counted clock.
#[derive(Clone, Copy, Debug)]
struct Reported {
    sync: LastSync,
    micros: u64,
}

/// The long clock of a foot relative to its counted one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LongClock {
    newest: Option<Reported>,
    /// Long clock minus counted clock, in steps modulo 2³²; whole turns.
    ahead: Option<u32>,
}

impl LongClock {
    /// Processes the SYNC reported with the contact of `short`, which is at `micros` on the counted clock.
    /// `is_sure` is true if no turn was guessed since the previous report.
    pub(super) fn take(
        &mut self,
        sync: LastSync,
        short: ShortTime,
        micros: u64,
        is_sure: bool,
    ) -> Verdict {
        let before = self.newest;
        if sync == LastSync::default() {
            self.newest = None;
            // A SYNC was reported before, so the foot has restarted.
            return match before {
                Some(_) => Verdict::Restarted,
                None => Verdict::Unknown,
            };
        }
        self.newest = Some(Reported { sync, micros });
        let Some(before) = before else {
            return Verdict::Unknown;
        };
        let passed = sync.time.0.wrapping_sub(before.sync.time.0) as i32;
        if passed < 0 {
            return Verdict::Restarted;
        }
        if passed == 0 {
            return Verdict::Unknown;
        }
        let age_us = age_us(sync, short);
        let since_us = micros.saturating_sub(before.micros) as i64;
        let long = sync.time.0.wrapping_add_signed((age_us / STEP_US) as i32);
        let ahead = long.wrapping_sub((micros / TIME_STEP_US) as u32);
        let Some(known) = self.ahead else {
            if is_sure && since_us < TURN_US - OVERTAKEN_US {
                self.ahead = Some(ahead);
            }
            return Verdict::Unknown;
        };
        let turns = i64::from(ahead.wrapping_sub(known) as i32 >> 16);
        match turns {
            0 => Verdict::Right,
            // The count is right if the SYNC is older by these turns, which is possible if it arrived soon
            // after the previous report.
            ..0 if age_us - turns * TURN_US <= since_us + OVERTAKEN_US => Verdict::Unknown,
            turns => Verdict::Off(turns),
        }
    }

    /// Returns whether no report has determined the long clock yet.
    pub(super) const fn is_unknown(&self) -> bool {
        self.ahead.is_none()
    }

    /// Follows a correction of the counted clock by `turns`; negative is backwards.
    pub(super) fn put_right(&mut self, turns: i64) {
        if let Some(newest) = &mut self.newest {
            newest.micros = newest.micros.saturating_add_signed(turns * TURN_US);
        }
    }

    /// Time of this SYNC on the counted clock, µs, which is now at `micros`; `None` if the long clock is
    /// unknown.
    pub(super) fn counted(&self, sync: LastSync, micros: u64) -> Option<u64> {
        let counted = sync.time.0.wrapping_sub(self.ahead?);
        let age = (micros / TIME_STEP_US) as u32;
        let age = age.wrapping_sub(counted) as i32;
        micros.checked_add_signed(-i64::from(age) * STEP_US)
    }
}

/// Time from the SYNC to the contact of `short`, µs, assumed to be less than a turn; negative if the SYNC
/// arrived between the contact's sample and the health frame.
fn age_us(sync: LastSync, short: ShortTime) -> i64 {
    let steps = short.0.wrapping_sub(sync.time.short().0);
    let age = i64::from(steps) * STEP_US;
    if age > TURN_US - OVERTAKEN_US {
        age - TURN_US
    } else {
        age
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::pdo::LongTime;

    /// Verdict on a contact at `micros` that was counted `off` turns too far, with a SYNC `age_us` before it.
    fn take(long: &mut LongClock, micros: u64, age_us: u64, off: u64, is_sure: bool) -> Verdict {
        let steps = |micros: u64| LongTime((micros / TIME_STEP_US) as u32);
        let sync = LastSync {
            counter: 1,
            time: steps(7_000 * TURN_US.unsigned_abs() + micros - age_us),
        };
        let short = steps(micros).short();
        long.take(sync, short, micros + off * TURN_US.unsigned_abs(), is_sure)
    }

    fn known() -> LongClock {
        let mut long = LongClock::default();
        for micros in [1_000_000, 1_100_000] {
            assert_eq!(take(&mut long, micros, 5_000, 0, true), Verdict::Unknown);
        }
        assert_eq!(take(&mut long, 1_200_000, 5_000, 0, true), Verdict::Right);
        long
    }

    #[test]
    fn only_a_recent_sync_reveals_wrong_turns() {
        let mut long = known();
        assert_eq!(
            take(&mut long, 5_000_000, 1_000_000, 0, false),
            Verdict::Unknown
        );
        assert_eq!(
            take(&mut long, 5_100_000, 5_000, 3, false),
            Verdict::Unknown
        );
        assert_eq!(
            take(&mut long, 5_200_000, 5_000, 3, false),
            Verdict::Off(-3)
        );
        long.put_right(-3);
        assert_eq!(take(&mut long, 5_300_000, 5_000, 0, true), Verdict::Right);
    }

    #[test]
    fn turns_are_known_after_two_syncs_within_one_turn() {
        for (micros, is_sure, is_unknown) in [
            (1_100_000, true, false),
            (1_100_000, false, true),
            (1_600_000, true, true),
        ] {
            let mut long = LongClock::default();
            take(&mut long, 1_000_000, 5_000, 0, true);
            take(&mut long, micros, 5_000, 0, is_sure);
            assert_eq!(long.is_unknown(), is_unknown, "{micros}, {is_sure}");
        }
    }

    #[test]
    fn clock_going_back_or_losing_its_sync_means_restart() {
        let mut long = known();
        assert_eq!(
            take(&mut long, 1_100_000, 5_000, 0, true),
            Verdict::Restarted
        );
        let verdict = known().take(LastSync::default(), ShortTime(7), 1_300_000, true);
        assert_eq!(verdict, Verdict::Restarted);
    }

    #[test]
    fn sync_after_the_sample_keeps_the_turn_count() {
        let mut long = known();
        let sync = LastSync {
            counter: 1,
            time: LongTime(((7_000 * TURN_US + 1_301_000) / STEP_US) as u32),
        };
        let verdict = long.take(
            sync,
            ShortTime((130_000_u32 & 0xFFFF) as u16),
            1_300_000,
            true,
        );
        assert_eq!(verdict, Verdict::Right);
        assert_eq!(long.counted(sync, 1_300_000), Some(1_301_000));
    }
}
