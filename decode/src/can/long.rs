//! The long clock of a foot, which its health frames tell with the last SYNC.
//!
//! A health frame says when the last SYNC came, in 32 bits; its contact says in 16 bits when that was
//! made. A SYNC that was not reported before came after the health frame before: where that was less
//! than a turn of the short clock ago, both together are the contact's time in 32 bits.
//!
//! Without SYNCs there is no long time, and what the turns were is not known. The same holds until a
//! foot has reported two SYNCs, and where health frames or SYNCs come less often than the short clock
//! turns: then more turns may be missing than are found. A foot that was not heard for more than six
//! hours is taken to have started again, as half of the long clock has passed then.

use wire::pdo::{LastSync, ShortTime, TIME_STEP_US};

use super::clock::{OVERTAKEN_US, STEP_US, TURN_US};

/// What a health frame says of the turns that were counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It says nothing: no SYNC that was not reported before, or one that may be old.
    Unknown,
    /// They are right.
    Right,
    /// The number of turns that passed without being counted; negative where too many were counted.
    Off(i64),
    /// The foot's clock has begun again.
    Restarted,
}

/// A SYNC that a foot reported, beside the contact of that time on the counted clock.
#[derive(Clone, Copy, Debug)]
struct Reported {
    sync: LastSync,
    micros: u64,
}

/// The long clock of a foot beside its counted one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LongClock {
    newest: Option<Reported>,
    /// The long clock less the counted one, in steps modulo 2³²: whole turns.
    ahead: Option<u32>,
}

impl LongClock {
    /// Takes in the SYNC that is reported beside the contact of `short`, which is `micros` on the
    /// counted clock. `is_sure` where no turn was guessed since the report before.
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
            // It had reported one.
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
            // The count is right where the SYNC is as old, which it may be if it came soon after the
            // report before.
            ..0 if age_us - turns * TURN_US <= since_us + OVERTAKEN_US => Verdict::Unknown,
            turns => Verdict::Off(turns),
        }
    }

    /// Whether no report has told it so far.
    pub(super) const fn is_unknown(&self) -> bool {
        self.ahead.is_none()
    }

    /// Takes in that the counted clock was moved forward by a number of turns, back where negative.
    pub(super) fn put_right(&mut self, turns: i64) {
        if let Some(newest) = &mut self.newest {
            newest.micros = newest.micros.saturating_add_signed(turns * TURN_US);
        }
    }

    /// When this SYNC came on the counted clock, µs, which is now at `micros`; `None` where the long
    /// clock is not known.
    pub(super) fn counted(&self, sync: LastSync, micros: u64) -> Option<u64> {
        let counted = sync.time.0.wrapping_sub(self.ahead?);
        let age = (micros / TIME_STEP_US) as u32;
        let age = age.wrapping_sub(counted) as i32;
        micros.checked_add_signed(-i64::from(age) * STEP_US)
    }
}

/// How long before the contact of `short` the SYNC came, µs, where that is less than a turn; negative
/// where it came between the contact's sample and the health frame.
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

    /// What is said of a contact of `micros` that was counted `off` turns too far, with a SYNC so long
    /// before it.
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
    fn a_sync_that_may_be_old_says_nothing_and_one_that_cannot_be_says_that_turns_are_wrong() {
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
    fn the_turns_are_known_after_two_syncs_less_than_a_turn_apart_without_a_gap() {
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
    fn a_clock_that_goes_back_or_has_no_sync_any_more_has_begun_again() {
        let mut long = known();
        assert_eq!(
            take(&mut long, 1_100_000, 5_000, 0, true),
            Verdict::Restarted
        );
        let verdict = known().take(LastSync::default(), ShortTime(7), 1_300_000, true);
        assert_eq!(verdict, Verdict::Restarted);
    }

    #[test]
    fn a_sync_between_a_sample_and_its_health_frame_is_no_turn_ago() {
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
