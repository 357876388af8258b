//! State of a foot in a log: time and number of its next contact.
//!
//! A contact has 16 bits of its foot's clock, which wrap every 655.36 ms; a health frame has the full clock, ten
//! times a second. A contact whose number agrees with its time continues the clock. Otherwise, as at the start
//! and after a loss, the log's clock determines the turn, and the time counts as not yet known until the next
//! health frame, which corrects it.

use estimator_core::Timestamp;
use wire::pdo::{ClockReading, Contact};

use super::Reception;
use super::clock::{Elapsed, Mark};
use super::pace::Pace;
use super::sync::{Alignment, Syncs};
use crate::decode::LeastDelay;
use crate::decode::report::Report;
use crate::decode::row::{Clock, Turn};

/// The state of a foot in a log.
#[derive(Clone)]
pub(super) struct LoggedFoot {
    /// Row of its newest contact; other frames of the foot complete this row.
    pub(super) row: usize,
    /// That contact.
    pub(super) newest: Mark,
    /// Newest contact whose time agrees with the log.
    mark: Mark,
    /// The contact before `mark`, used if the log's time of `mark` was wrong.
    before: Option<Mark>,
    /// A newer contact whose time contradicts the log, if it was the last.
    suspect: Option<Mark>,
    /// Newest sequence number.
    sequence: u8,
    /// Change of the number of missing contacts that no row shows yet.
    missing: i64,
    pace: Pace,
    /// `None` if the turn of the newest contact is known.
    gap: Option<Gap>,
    /// Offset of its clock from the log's.
    alignment: Alignment,
    reception: Reception,
    /// Least delay of live frames, which may be queued before they are read; `None` until the time is known.
    least: Option<LeastDelay>,
}

/// Start of the contacts whose turn is not known yet.
#[derive(Clone, Copy)]
struct Gap {
    /// Row of the first.
    row: usize,
    /// Whether the turn was known before it.
    before: Turn,
    /// Time assumed from the contact before to the first, µs.
    elapsed_us: i64,
    /// Difference of their sequence numbers, modulo 256.
    numbers: u8,
    /// Number of contacts missing in that time.
    missing: i64,
}

/// Change made by a health frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// None: the turn was known, and right.
    None,
    /// The turn is known from this row on, which shifts the times by a number of µs.
    Turn(usize, i64),
    /// The same, and the foot has restarted before that row: its clock went back.
    Restart(usize, i64),
}

impl LoggedFoot {
    /// A foot whose first contact, logged at `at`, becomes `row`.
    pub(super) fn new(
        contact: &Contact,
        row: usize,
        at: Option<Timestamp>,
        reception: Reception,
    ) -> Self {
        let first = Mark::first(contact.timestamp, contact.sequence, at);
        Self {
            row,
            newest: first,
            mark: first,
            before: None,
            suspect: None,
            sequence: contact.sequence,
            missing: 0,
            pace: Pace::default(),
            gap: Some(Gap { row, before: Turn::NotYet, elapsed_us: 0, numbers: 1, missing: 0 }),
            alignment: Alignment::default(),
            reception,
            least: None,
        }
    }

    /// Whether the turn of the newest contact is known.
    pub(super) const fn turn(&self) -> Turn {
        match self.gap {
            None => Turn::Known,
            Some(_) => Turn::NotYet,
        }
    }

    /// Processes the next contact, logged at `at`, which becomes `row`. Returns its time on the foot's clock,
    /// µs, or `None` for a duplicate. Gaps and contradictions are counted in the report.
    pub(super) fn take(
        &mut self,
        contact: &Contact,
        row: usize,
        at: Option<Timestamp>,
        report: &mut Report,
    ) -> Option<u64> {
        let (short, sequence) = (contact.timestamp, contact.sequence);
        let newest = match self.mark.by_number(short, sequence, self.pace) {
            Some(elapsed_us) => {
                let next = self.mark.after(elapsed_us, short, sequence, at);
                self.take_by_number(next, row, elapsed_us, at, report);
                next
            }
            None => self.take_by_log(contact, row, at, report)?,
        };
        (self.row, self.newest) = (row, newest);
        if let (Reception::Live, Turn::Known, Some(at)) = (self.reception, self.turn(), at) {
            match &mut self.least {
                Some(least) => least.take(newest.micros, at),
                least => *least = Some(LeastDelay::of(newest.micros, at)),
            }
        }
        Some(newest.micros)
    }

    /// Processes a contact whose number agrees with its time.
    fn take_by_number(
        &mut self,
        next: Mark,
        row: usize,
        elapsed_us: i64,
        at: Option<Timestamp>,
        report: &mut Report,
    ) {
        self.suspect = None;
        if elapsed_us < 0 {
            self.overtaken(report);
            return;
        }
        let contacts = next.sequence.wrapping_sub(self.mark.sequence);
        self.pace.take(elapsed_us.unsigned_abs(), contacts.into());
        let numbers = next.sequence.wrapping_sub(self.sequence);
        let missing = i64::from(numbers.wrapping_sub(1));
        self.count_missing(missing, report);
        report.count_step(self.mark.micros, next.micros);
        if !self.mark.is_logged_after(elapsed_us, at) {
            report.count_problem(match self.reception {
                Reception::Logged => "clock_of_the_log_set",
                Reception::Live => "contacts_that_waited",
            });
            self.doubt(row, elapsed_us, numbers, missing);
        }
        self.before = Some(self.mark);
        (self.mark, self.sequence) = (next, next.sequence);
    }

    /// Processes a contact whose number does not agree with its time: the log's clock determines the turn.
    /// Returns `None` for a duplicate.
    fn take_by_log(
        &mut self,
        contact: &Contact,
        row: usize,
        at: Option<Timestamp>,
        report: &mut Report,
    ) -> Option<Mark> {
        let (short, sequence) = (contact.timestamp, contact.sequence);
        let numbers = sequence.wrapping_sub(self.sequence);
        let after_suspect = self.suspect.take().and_then(|suspect| {
            let elapsed = suspect.elapsed(short, at);
            // The two contacts agree, so the mark is out of date.
            let is_after = matches!(elapsed, Elapsed::Agreed(1..));
            is_after.then(|| suspect.after(elapsed.micros(), short, sequence, at))
        });
        let mut elapsed = self.mark.elapsed(short, at);
        if let Some(before) = self.before
            && let Elapsed::Agreed(nearer) = before.elapsed(short, at)
            && nearer > 0
            && !matches!(elapsed, Elapsed::Agreed(elapsed) if elapsed < nearer)
        {
            report.count_problem("times_against_the_log");
            (self.mark, elapsed) = (before, Elapsed::Agreed(nearer));
        }
        if elapsed == Elapsed::Agreed(0) && numbers == 0 {
            report.duplicates += 1;
            return None;
        }
        if self.reception == Reception::Live {
            // Frames that waited arrive at once: their times of reception say too little.
            elapsed = elapsed.forward();
        }
        let next = match (elapsed, after_suspect) {
            (Elapsed::Contradicted(_), Some(next)) => next,
            _ => self.mark.after(elapsed.micros(), short, sequence, at),
        };
        let is_back = matches!(elapsed, Elapsed::Agreed(elapsed) if elapsed < 0);
        // Both time and number must go back: if only the time does, it is wrong.
        if is_back && numbers > 1 << 7 {
            self.overtaken(report);
            return Some(next);
        }
        let missing = self.pace.missing(elapsed.micros(), numbers);
        self.count_missing(missing, report);
        if !(numbers == 1 && self.pace.is_unknown() && elapsed.is_within_a_turn()) {
            self.doubt(row, elapsed.micros(), numbers, missing);
        }
        self.sequence = sequence;
        if let (Elapsed::Contradicted(_), None) = (elapsed, after_suspect) {
            report.count_problem("times_against_the_log");
            self.suspect = Some(next);
            return Some(next);
        }
        if is_back {
            report.count_problem("times_that_run_backwards");
        } else if let Elapsed::Unbridged(_) = elapsed {
            report.count_problem("clock_of_the_log_set");
        }
        report.count_step(self.mark.micros, next.micros);
        if numbers == 1 {
            self.pace.take_first(elapsed.micros());
        }
        self.before = after_suspect.is_none().then_some(self.mark);
        self.mark = next;
        Some(next)
    }

    fn count_missing(&mut self, missing: i64, report: &mut Report) {
        report.count_missing(missing.unsigned_abs());
        self.missing += missing;
    }

    /// Changes the number missing in a gap that is already counted.
    fn correct_missing(&mut self, more: i64, report: &mut Report) {
        report.correct_missing(more);
        self.missing += more;
    }

    /// Counts a contact that arrived after a later one, before which it was counted as missing.
    fn overtaken(&mut self, report: &mut Report) {
        report.count_problem("contacts_out_of_order");
        self.missing -= 1;
    }

    /// Change of the number of missing contacts since the last call.
    pub(super) const fn take_missing(&mut self) -> i64 {
        std::mem::replace(&mut self.missing, 0)
    }

    /// Marks the turn as not yet known from `row` on, whose contact follows the one before by `elapsed_us`.
    fn doubt(&mut self, row: usize, elapsed_us: i64, numbers: u8, missing: i64) {
        let before = self.gap.map_or(Turn::Known, |gap| gap.before);
        self.gap = Some(Gap { row, before, elapsed_us, numbers, missing });
    }

    /// Processes the clock in a health frame, which follows the newest contact.
    pub(super) fn read_clock(&mut self, reading: ClockReading, report: &mut Report) -> Change {
        let ahead = self.newest.behind(reading);
        let Some(gap) = self.gap.take() else {
            let shift_us = ahead.nearest_us();
            if shift_us == 0 {
                return Change::None;
            }
            // A loss of a multiple of 256 contacts and of whole turns, or a restart, looked like the next contact.
            self.shift(shift_us);
            if shift_us < 0 {
                return self.restart(self.row, shift_us);
            }
            report.count_problem("turns_that_were_wrong");
            self.count_missing(self.pace.missing(shift_us, 0), report);
            report.count_step(0, shift_us.unsigned_abs());
            return Change::Turn(self.row, shift_us);
        };
        if gap.before == Turn::NotYet {
            let shift_us = ahead.first_us();
            self.shift(shift_us);
            return Change::Turn(gap.row, shift_us);
        }
        let shift_us = ahead.nearest_us();
        self.shift(shift_us);
        let elapsed_us = gap.elapsed_us + shift_us;
        if shift_us < 0 && elapsed_us <= 0 {
            self.correct_missing(-gap.missing, report);
            return self.restart(gap.row, shift_us);
        }
        if shift_us != 0 {
            let missing = self.pace.missing(elapsed_us, gap.numbers);
            self.correct_missing(missing - gap.missing, report);
            report.count_step(0, elapsed_us.unsigned_abs());
        }
        Change::Turn(gap.row, shift_us)
    }

    /// Moves the clock by whole turns, µs, and continues from the newest contact.
    fn shift(&mut self, shift_us: i64) {
        if shift_us == 0 && self.suspect.is_none() {
            return;
        }
        self.newest.shift(shift_us);
        (self.mark, self.sequence) = (self.newest, self.newest.sequence);
        (self.before, self.suspect, self.least) = (None, None, None);
    }

    fn restart(&mut self, from: usize, shift_us: i64) -> Change {
        self.alignment = Alignment::default();
        Change::Restart(from, shift_us)
    }

    /// Aligns the clock with the log's by the SYNC that a health frame reports, if it does. Returns the offset
    /// from the foot's clock to the log's, µs, if known.
    pub(super) fn align(&mut self, reading: ClockReading, syncs: &Syncs) -> Option<i64> {
        let time = self.newest.time_of(reading)?;
        self.alignment.take(reading, time, syncs, self.least);
        self.offset()
    }

    /// Offset from its clock to the log's, µs, if known from SYNCs.
    fn offset(&self) -> Option<i64> {
        let offset = self.alignment.offset()?;
        // No contact is made after it was received.
        let latest = self.least.map(LeastDelay::offset_us);
        Some(latest.map_or(offset, |latest| offset.min(latest)))
    }

    /// Converts a time of its clock, µs, to the log's, if the offset is known from SYNCs.
    pub(super) fn common(&self, micros: u64) -> Option<(Timestamp, Clock)> {
        let common = micros.checked_add_signed(self.offset()?)?;
        Some((Timestamp::from_micros(common), Clock::Sync))
    }
}
