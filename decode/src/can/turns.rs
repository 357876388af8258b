//! The turns of a foot's short clock where frames come live.
//!
//! A host that stalls receives frames late: an adapter or the kernel keeps the first ones and drops the
//! later ones. So the time of reception says only when a contact was made at the latest. Contacts that
//! follow each other by number and by the foot's own clock do so, however late they come. After a gap the
//! turn is the last that reception allows and at which the number, modulo 256, is that of the foot's pace:
//! what comes after a gap was made when there was room again. Both say how many contacts are missing.
//! Health frames put that right where it was wrong ([`LongClock`]).
//!
//! A contact that follows by number within a few periods of the foot's clock is the next one, whatever reception
//! allows: a foot whose clock is slower than the receiver's, as on an overloaded emulator, has no gaps.
//!
//! What cannot be known, for good where no SYNCs are on the bus, otherwise until the next health frame or
//! the one after:
//! - a contact after a gap that has itself waited for more than half a second may be taken to be later or
//!   earlier by whole turns, and as many contacts more or fewer count as missing;
//! - a loss of a multiple of 256 contacts that lasts whole turns, 16.384 s at 1 kHz, is not seen;
//! - a foot that starts again while nothing is received, and whose boot-up is lost, is taken to go on,
//!   also where its new clock is ahead of the old one by the time at which it reports a SYNC;
//! - a foot that sends nothing for a time does not count in it, which is no loss. It is taken for one where
//!   the pause is as long as a multiple of 256 contacts, within one in 256 of it.

use estimator_core::Timestamp;
use wire::pdo::{LastSync, ShortTime};

use super::clock::{LONGEST_BRIDGE_US, LONGEST_RETURN_US, OVERTAKEN_US, STEP_US, TURN_US};
use super::long::{LongClock, Verdict};
use super::pace::{LeastDelay, Pace};

/// By how much sooner than the soonest so far a contact may come, µs.
const SOONER_US: i64 = 50_000;

/// A part of a gap by which clocks drift at most: 250 ppm.
const DRIFT: i64 = 4096;

/// Turns of the short clock that are tried where a contact after a gap has waited: 42 s.
const TRIED: i64 = 64;

/// A contact that waited for longer has waited in a stall, µs.
const STALL_US: i64 = TURN_US / 4;

/// The longest time to the next contact by number, in periods: after a longer one the foot has paused.
const MOST_PERIODS: u64 = 8;

/// Numbers of contacts are modulo this.
const NUMBERS: i64 = 1 << 8;

/// What a contact is after those before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The number of contacts missing between the newest and this one.
    Forward(u64),
    /// Another has overtaken it.
    Late,
    /// It came before.
    Duplicate,
}

/// Whether contacts come at once or have waited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Waiting {
    /// They come at once.
    No,
    /// They have waited, and did so before.
    Still,
    /// This is the first that has.
    Begins,
    /// The clock of the receiver was set: nothing can be said.
    Unknown,
}

/// The next contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    /// Its time on the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    /// What it is.
    pub(super) step: Step,
    /// Whether it has waited.
    pub(super) waiting: Waiting,
}

impl Next {
    /// The first contact of a foot.
    pub(super) const fn first(micros: u64) -> Self {
        Self {
            micros,
            step: Step::Forward(0),
            waiting: Waiting::No,
        }
    }
}

/// What a health frame has put right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Correction {
    /// Nothing.
    None,
    /// The clock, by turns, and with it the number of missing contacts.
    Turns {
        /// How many contacts more.
        missing: i64,
        /// From the contact before the gap to the one after it, µs.
        gap_us: i64,
    },
    /// The foot has started again.
    Restarted,
}

/// The newest gap since the turns were known to be right.
#[derive(Clone, Copy, Debug)]
struct Gap {
    elapsed_us: i64,
    numbers: u8,
    missing: i64,
    /// The least delay before it.
    least: LeastDelay,
}

/// A foot whose contacts come live.
#[derive(Clone, Copy)]
pub(super) struct Turns {
    pub(super) micros: u64,
    short: ShortTime,
    sequence: u8,
    at: Timestamp,
    pace: Pace,
    /// The time from one contact to the next by number that was not of the pace, if that came last, µs.
    other_pace_us: i64,
    least: LeastDelay,
    waits: bool,
    long: LongClock,
    gap: Option<Gap>,
}

impl Turns {
    /// A foot from its first contact on: its short clock is taken to be in its first turn.
    pub(super) fn new(short: ShortTime, sequence: u8, at: Timestamp) -> Self {
        let micros = (i64::from(short.0) * STEP_US).unsigned_abs();
        Self {
            micros,
            short,
            sequence,
            at,
            pace: Pace::default(),
            other_pace_us: 0,
            least: LeastDelay::of(micros, at),
            waits: false,
            long: LongClock::default(),
            gap: None,
        }
    }

    /// Takes in the next contact, received at `at`.
    pub(super) fn take(&mut self, short: ShortTime, sequence: u8, at: Timestamp) -> Next {
        let steps_us = i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US;
        let numbers = sequence.wrapping_sub(self.sequence);
        let received = at.as_micros().wrapping_sub(self.at.as_micros()) as i64;
        if numbers == 0 && steps_us == 0 && received.abs() < TURN_US / 2 {
            return self.aside(0, Step::Duplicate);
        }
        if self.is_late(steps_us, numbers) {
            return self.aside(steps_us - TURN_US, Step::Late);
        }
        let bridge = LONGEST_RETURN_US..LONGEST_BRIDGE_US;
        let (elapsed_us, missing) = match self.following(steps_us, numbers) {
            Some(elapsed_us) => {
                let contacts = fewest(numbers);
                self.pace
                    .take(elapsed_us.unsigned_abs(), contacts.unsigned_abs());
                self.other_pace_us = 0;
                (elapsed_us, contacts - 1)
            }
            None if self.is_next(steps_us, numbers) => {
                self.learn_pace(steps_us, numbers);
                (steps_us, 0)
            }
            None if bridge.contains(&received) => {
                let elapsed_us = self.across(steps_us, numbers, at);
                let missing = self.missing(elapsed_us, numbers);
                self.learn_pace(elapsed_us, numbers);
                self.gap = Some(Gap {
                    elapsed_us,
                    numbers,
                    missing,
                    least: self.least,
                });
                (elapsed_us, missing)
            }
            None => {
                let missing = i64::from(numbers.wrapping_sub(1));
                self.gap = Some(Gap {
                    elapsed_us: steps_us,
                    numbers,
                    missing,
                    least: self.least,
                });
                (steps_us, missing)
            }
        };
        self.micros = self.micros.saturating_add_signed(elapsed_us);
        (self.short, self.sequence, self.at) = (short, sequence, at);
        let waiting = if !bridge.contains(&received) {
            Waiting::Unknown
        } else if self.least.waited(self.micros, at) < STALL_US {
            Waiting::No
        } else if self.waits {
            Waiting::Still
        } else {
            Waiting::Begins
        };
        self.waits = matches!(waiting, Waiting::Begins | Waiting::Still);
        if waiting == Waiting::Unknown {
            self.least = LeastDelay::of(self.micros, at);
        }
        self.least.take(self.micros, at);
        Next {
            micros: self.micros,
            step: Step::Forward(missing.unsigned_abs()),
            waiting,
        }
    }

    /// Takes in the SYNC that a health frame beside the newest contact reports.
    pub(super) fn health(&mut self, sync: LastSync) -> Correction {
        let is_sure = self.gap.is_none();
        match self.long.take(sync, self.short, self.micros, is_sure) {
            Verdict::Unknown => {
                if self.long.is_unknown() {
                    // From here on the turns are counted from this report.
                    self.gap = None;
                }
                Correction::None
            }
            Verdict::Right => {
                self.gap = None;
                Correction::None
            }
            Verdict::Off(turns) => {
                // Where there was none, a gap looked like the next contact.
                let gap = self.gap.take().unwrap_or(Gap {
                    elapsed_us: 0,
                    numbers: 1,
                    missing: 0,
                    least: self.least,
                });
                let gap_us = gap.elapsed_us + turns * TURN_US;
                self.micros = self.micros.saturating_add_signed(turns * TURN_US);
                self.long.put_right(turns);
                if turns < 0 {
                    // What was too far on made delays look less than they were.
                    self.least = gap.least;
                }
                self.least.take(self.micros, self.at);
                Correction::Turns {
                    missing: self.missing(gap_us, gap.numbers) - gap.missing,
                    gap_us,
                }
            }
            Verdict::Restarted => Correction::Restarted,
        }
    }

    /// When a SYNC came on the counted clock, µs; `None` where the long clock is not known.
    pub(super) fn counted(&self, sync: LastSync) -> Option<u64> {
        self.long.counted(sync, self.micros)
    }

    /// What is to be added to the counted clock, µs, where SYNCs say `offset`: no contact was made after
    /// it was received.
    pub(super) fn at_most(&self, offset: i64) -> i64 {
        offset.min(self.least.offset())
    }

    /// Whether a SYNC whose time of reception differs by this from the foot's clock, µs, may have waited
    /// in a stall.
    pub(super) fn has_waited(&self, difference: i64) -> bool {
        difference > self.least.offset().saturating_add(SOONER_US)
    }

    /// A contact that does not become the newest.
    const fn aside(&self, elapsed_us: i64, step: Step) -> Next {
        Next {
            micros: self.micros.saturating_add_signed(elapsed_us),
            step,
            waiting: Waiting::No,
        }
    }

    /// Whether it lies back by number and as far by the foot's clock.
    fn is_late(&self, steps_us: i64, numbers: u8) -> bool {
        let back_us = TURN_US - steps_us;
        let contacts = numbers.wrapping_neg();
        numbers >= 1 << 7
            && back_us < OVERTAKEN_US
            && self
                .pace
                .time_of(contacts.into())
                .is_none_or(|time| (time - back_us).abs() <= self.tolerance_us(time))
    }

    /// The time to a contact whose number has advanced by `numbers`, where the foot's clock agrees that no
    /// more were made in between, µs.
    fn following(&self, steps_us: i64, numbers: u8) -> Option<i64> {
        let expected = self.pace.time_of(fewest(numbers).unsigned_abs())?;
        let turns = (expected - steps_us + TURN_US / 2).div_euclid(TURN_US);
        let elapsed = steps_us + turns * TURN_US;
        let is_near = (elapsed - expected).abs() <= self.tolerance_us(expected);
        (is_near && elapsed > 0).then_some(elapsed)
    }

    /// Whether it is the next contact, though earlier or later than the pace has it: an edge that was late.
    /// The time of reception says nothing then, which may run away from a foot that is slow.
    fn is_next(&self, steps_us: i64, numbers: u8) -> bool {
        let longest = self.pace.time_of(MOST_PERIODS);
        numbers == 1 && steps_us > 0 && longest.is_some_and(|longest| steps_us <= longest)
    }

    /// By how much the time of contacts of the pace may differ from the expected, µs: by half of one,
    /// and by what the pace changes.
    fn tolerance_us(&self, expected: i64) -> i64 {
        let half = self.pace.time_of(1).unwrap_or_default() / 2;
        (half + expected / 256).min(TURN_US / 4)
    }

    /// The time to a contact after a gap, µs: the longest with which it was made before it was received
    /// at `at`; shorter where only then its number is that of the pace, as it has waited, too.
    fn across(&self, steps_us: i64, numbers: u8, at: Timestamp) -> i64 {
        let room = self.least.waited(self.micros, at);
        let sooner = (SOONER_US + room.max(0) / DRIFT).min(TURN_US / 2);
        let turns = (room + sooner - steps_us).div_euclid(TURN_US).max(0);
        let longest = steps_us + turns * TURN_US;
        if numbers == 1 || self.contradiction(longest, numbers) <= 2 + self.made(longest) / 256 {
            return longest;
        }
        let shorter = (0..turns.min(TRIED)).map(|fewer| longest - (fewer + 1) * TURN_US);
        let mut fits = shorter
            .filter(|time| self.contradiction(*time, numbers) <= 1 + self.made(*time) / 1024);
        fits.next().unwrap_or(longest)
    }

    /// How many contacts the foot has made in a time, µs, by its pace; none where that is not known.
    fn made(&self, elapsed_us: i64) -> i64 {
        self.pace.contacts_in(elapsed_us).unwrap_or_default()
    }

    /// By how many contacts the number and the pace contradict each other at the end of a time, µs.
    fn contradiction(&self, elapsed_us: i64, numbers: u8) -> i64 {
        let made = self.made(elapsed_us);
        (made - nearest(made, numbers)).abs()
    }

    /// How many contacts are missing in a time, µs, in which the number has advanced by `numbers`: the
    /// pace says how many were made, nearly, and the number, exactly, modulo 256. Where it is the next
    /// number and they contradict each other, the foot has paused.
    fn missing(&self, elapsed_us: i64, numbers: u8) -> i64 {
        let made = self.made(elapsed_us);
        if numbers == 1 && self.contradiction(elapsed_us, numbers) > 2 + made / 256 {
            return 0;
        }
        nearest(made, numbers) - 1
    }

    /// Two contacts that follow by number, with a time in between that is not of the pace, are of another
    /// pace, where the ones before were so, too.
    fn learn_pace(&mut self, elapsed_us: i64, numbers: u8) {
        if numbers != 1 {
            return;
        }
        let before = std::mem::replace(&mut self.other_pace_us, elapsed_us);
        let is_first = self.pace.time_of(1).is_none();
        if elapsed_us > 0 && (is_first || (before - elapsed_us).abs() <= elapsed_us / 4) {
            self.pace = Pace::of(elapsed_us.unsigned_abs());
        }
    }
}

/// The fewest contacts, one or more, by which a number modulo 256 advances by `numbers`.
const fn fewest(numbers: u8) -> i64 {
    numbers.wrapping_sub(1) as i64 + 1
}

/// The number of contacts nearest to `made` by which a number modulo 256 advances by `numbers`; not zero.
fn nearest(made: i64, numbers: u8) -> i64 {
    let fewest = fewest(numbers);
    let turns = (made - fewest + NUMBERS / 2).div_euclid(NUMBERS).max(0);
    fewest + turns * NUMBERS
}
