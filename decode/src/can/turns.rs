//! Turns of a foot's short clock for frames received live.
//!
//! A stalled host receives frames late: an adapter or the kernel keeps the first frames and drops the later
//! ones. The time of reception is therefore only an upper limit of a contact's time. Contacts that are
//! consecutive by number and by the foot's clock are consecutive regardless of delay. After a gap, the turn
//! is the latest that reception allows and whose number, modulo 256, matches the foot's pace: the first
//! frame after a gap was sent when the queue had room again. Turn and number give the number of missing
//! contacts. Health frames correct errors ([`LongClock`]).
//!
//! A contact with the next number within a few periods of the foot's clock is the next one, regardless of the
//! time of reception: a foot whose clock is slower than the receiver's, as on an overloaded emulator, has no
//! gaps.
//!
//! Limitations, permanent if no SYNCs are on the bus, otherwise until the next health frame or the one after:
//! - a contact after a gap that was itself delayed by more than half a second may be placed whole turns too
//!   late or too early, with the number of missing contacts changed accordingly;
//! - a loss of a multiple of 256 contacts that lasts whole turns, 16.384 s at 1 kHz, is not detected;
//! - a foot that restarts while nothing is received, and whose boot-up is lost, is taken to continue;
//!   with SYNCs on the bus, only if its new clock is ahead of the old one when it reports a SYNC;
//! - a foot that pauses does not advance its number, so nothing is missing. The pause is mistaken for a loss
//!   if its length matches a multiple of 256 contacts, within one in 256 of it.

use estimator_core::Timestamp;
use wire::pdo::{LastSync, ShortTime};

use super::clock::{LONGEST_BRIDGE_US, LONGEST_RETURN_US, OVERTAKEN_US, STEP_US, TURN_US};
use super::long::{LongClock, Verdict};
use super::pace::{LeastDelay, Pace};

/// Time by which a contact may undercut the least delay so far, µs.
const SOONER_US: i64 = 50_000;

/// Divisor of a gap that gives the largest drift of the clocks: 250 ppm.
const DRIFT: i64 = 4096;

/// Turns of the short clock tried for a delayed contact after a gap: 42 s.
const TRIED: i64 = 64;

/// Delay from which a contact is taken to be delayed by a stall, µs.
const STALL_US: i64 = TURN_US / 4;

/// Longest time to the contact with the next number, in periods; a longer time is a pause of the foot.
const MOST_PERIODS: u64 = 8;

/// Modulus of the sequence numbers.
const NUMBERS: i64 = 1 << 8;

/// Relation of a contact to the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// A newer contact, with the number of contacts missing before it.
    Forward(u64),
    /// Another contact has overtaken it.
    Late,
    /// It was received before.
    Duplicate,
}

/// Whether contacts are received at once or delayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Waiting {
    /// Received at once.
    No,
    /// Delayed, as was the previous one.
    Still,
    /// The first delayed one.
    Begins,
    /// Unknown: the receiver's clock was set.
    Unknown,
}

/// Result of processing a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    /// Time on the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    /// Relation to the previous contacts.
    pub(super) step: Step,
    /// Whether it was delayed.
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

/// Correction made from a health frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Correction {
    /// Nothing.
    None,
    /// The clock was moved by turns, which changes the number of missing contacts.
    Turns {
        /// Number of additional missing contacts; negative if fewer are missing.
        missing: i64,
        /// Time from the contact before the gap to the one after it, µs.
        gap_us: i64,
    },
    /// The foot has restarted.
    Restarted,
}

/// The newest gap since the turns were last verified.
#[derive(Clone, Copy, Debug)]
struct Gap {
    elapsed_us: i64,
    numbers: u8,
    missing: i64,
    /// Least delay before the gap.
    least: LeastDelay,
}

/// Clock of a foot whose contacts are received live.
#[derive(Clone, Copy)]
pub(super) struct Turns {
    pub(super) micros: u64,
    short: ShortTime,
    sequence: u8,
    at: Timestamp,
    pace: Pace,
    /// Time between consecutive contacts that did not match the pace, if it was the last, µs.
    other_pace_us: i64,
    least: LeastDelay,
    waits: bool,
    long: LongClock,
    gap: Option<Gap>,
}

impl Turns {
    /// Starts from the first contact; the short clock is assumed to be in its first turn.
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

    /// Processes the next contact, received at `at`.
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

    /// Processes the SYNC reported by the health frame of the newest contact.
    pub(super) fn health(&mut self, sync: LastSync) -> Correction {
        let is_sure = self.gap.is_none();
        match self.long.take(sync, self.short, self.micros, is_sure) {
            Verdict::Unknown => {
                if self.long.is_unknown() {
                    // Turns are counted from this report on.
                    self.gap = None;
                }
                Correction::None
            }
            Verdict::Right => {
                self.gap = None;
                Correction::None
            }
            Verdict::Off(turns) => {
                // If no gap was found, it looked like the next contact.
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
                    // Contacts timed too late made delays look shorter than they were.
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

    /// Time of a SYNC on the counted clock, µs; `None` if the long clock is unknown.
    pub(super) fn counted(&self, sync: LastSync) -> Option<u64> {
        self.long.counted(sync, self.micros)
    }

    /// Limits the `offset` obtained from SYNCs, µs, so that no contact is made after it was received.
    pub(super) fn at_most(&self, offset: i64) -> i64 {
        offset.min(self.least.offset())
    }

    /// Returns whether a SYNC whose time of reception differs by `difference` from the foot's clock, µs, may
    /// have been delayed by a stall.
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

    /// Returns whether the contact is older by number and equally older by the foot's clock.
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

    /// Time to a contact whose number has advanced by `numbers`, µs, if the foot's clock agrees that no more
    /// contacts were made in between.
    fn following(&self, steps_us: i64, numbers: u8) -> Option<i64> {
        let expected = self.pace.time_of(fewest(numbers).unsigned_abs())?;
        let turns = (expected - steps_us + TURN_US / 2).div_euclid(TURN_US);
        let elapsed = steps_us + turns * TURN_US;
        let is_near = (elapsed - expected).abs() <= self.tolerance_us(expected);
        (is_near && elapsed > 0).then_some(elapsed)
    }

    /// Returns whether it is the next contact, though earlier or later than the pace predicts, as with a late
    /// edge. The time of reception is not used: it may run ahead of a slow foot.
    fn is_next(&self, steps_us: i64, numbers: u8) -> bool {
        let longest = self.pace.time_of(MOST_PERIODS);
        numbers == 1 && steps_us > 0 && longest.is_some_and(|longest| steps_us <= longest)
    }

    /// Tolerance of the time of contacts at the pace, µs: half a period plus the change of the pace.
    fn tolerance_us(&self, expected: i64) -> i64 {
        let half = self.pace.time_of(1).unwrap_or_default() / 2;
        (half + expected / 256).min(TURN_US / 4)
    }

    /// Time to a contact after a gap, µs: the longest that places it before its reception at `at`, or a
    /// shorter one if only that matches its number to the pace, because the contact was itself delayed.
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

    /// Number of contacts made in `elapsed_us` at the foot's pace; 0 if the pace is unknown.
    fn made(&self, elapsed_us: i64) -> i64 {
        self.pace.contacts_in(elapsed_us).unwrap_or_default()
    }

    /// Number of contacts by which sequence number and pace differ after `elapsed_us`.
    fn contradiction(&self, elapsed_us: i64, numbers: u8) -> i64 {
        let made = self.made(elapsed_us);
        (made - nearest(made, numbers)).abs()
    }

    /// Number of contacts missing in `elapsed_us`, in which the number has advanced by `numbers`. The pace
    /// gives the number of contacts made approximately, the sequence number exactly, modulo 256. If the number
    /// is the next one and contradicts the pace, the foot has paused.
    fn missing(&self, elapsed_us: i64, numbers: u8) -> i64 {
        let made = self.made(elapsed_us);
        if numbers == 1 && self.contradiction(elapsed_us, numbers) > 2 + made / 256 {
            return 0;
        }
        nearest(made, numbers) - 1
    }

    /// Adopts a new pace if consecutive contacts differ from the current pace by about the same time twice in a
    /// row.
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

/// Fewest contacts, one or more, by which a number modulo 256 advances by `numbers`.
const fn fewest(numbers: u8) -> i64 {
    numbers.wrapping_sub(1) as i64 + 1
}

/// Number of contacts nearest to `made` by which a number modulo 256 advances by `numbers`; not zero.
fn nearest(made: i64, numbers: u8) -> i64 {
    let fewest = fewest(numbers);
    let turns = (made - fewest + NUMBERS / 2).div_euclid(NUMBERS).max(0);
    fewest + turns * NUMBERS
}
