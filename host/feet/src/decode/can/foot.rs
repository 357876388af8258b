//! State of a foot on CAN: the time of each contact on the clock of the foot, and the number of contacts missing before it.
//! Here "the log's clock" is the clock of reception, even if frames are received live.
//!
//! A contact has 16 bits of its foot's clock, which wrap every 655.36 ms; a health frame has the full clock, ten
//! times a second. A contact whose number agrees with its time continues the clock. Otherwise, as at the start
//! and after a loss, the log's clock determines the turn, and the time counts as not yet known until the next
//! health frame, which corrects it.
//!
//! | type | state |
//! |---|---|
//! | [`FootOnCan`] | the newest contact, the contacts missing before it, the contacts whose turn is not known yet |
//! | [`Mark`] | one contact: its number, and its time on both clocks |
//! | [`ContactPace`] | mean period of the contacts, with which numbers and times must agree |
//! | [`SyncAlignment`] | offset of the foot's clock from the log's, by numbered SYNCs |

use std::collections::BTreeMap;

use estimator_core::Timestamp;
use wire::pdo::{ClockReading, Contact, ShortTime, TIME_STEP_US};

use super::Reception;
use crate::decode::report::Report;
use crate::decode::row::{ClockTurn, CommonClock};
use crate::foot_clock::LeastDelay;

/// State of a foot on CAN.
#[derive(Clone)]
pub(super) struct FootOnCan {
    /// Row of its newest contact; other frames of the foot complete this row.
    pub(super) row: usize,
    /// Newest contact of the foot.
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
    pace: ContactPace,
    /// `None` if the turn of the newest contact is known.
    gap: Option<Gap>,
    /// Offset of its clock from the log's.
    alignment: SyncAlignment,
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
    before: ClockTurn,
    /// Time assumed from the contact before to the first, µs.
    elapsed_us: i64,
    /// Difference of their sequence numbers, modulo 256.
    numbers: u8,
    /// Number of contacts missing in that time.
    missing: i64,
}

/// Change made by a health frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockCorrection {
    /// Nothing: the turn was known and right.
    None,
    /// The turn is known from this row on, which shifts the times by a number of µs.
    Turn(usize, i64),
    /// A turn as in [`Turn`](Self::Turn), before whose row the foot has restarted, because its clock went back.
    Restart(usize, i64),
}

impl FootOnCan {
    /// Creates a foot whose first contact, logged at `at`, becomes `row`.
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
            pace: ContactPace::default(),
            gap: Some(Gap {
                row,
                before: ClockTurn::NotYet,
                elapsed_us: 0,
                numbers: 1,
                missing: 0,
            }),
            alignment: SyncAlignment::default(),
            reception,
            least: None,
        }
    }

    /// Returns whether the turn of the newest contact is known.
    pub(super) const fn turn(&self) -> ClockTurn {
        match self.gap {
            None => ClockTurn::Known,
            Some(_) => ClockTurn::NotYet,
        }
    }

    /// Processes the next contact, logged at `at`, which becomes `row` unless it is a duplicate. Returns false for a
    /// duplicate. Gaps and contradictions are counted in the report.
    pub(super) fn take(
        &mut self,
        contact: &Contact,
        row: usize,
        at: Option<Timestamp>,
        report: &mut Report,
    ) -> bool {
        let (short, sequence) = (contact.timestamp, contact.sequence);
        let newest = match self.mark.by_number(short, sequence, self.pace) {
            Some(elapsed_us) => {
                let next = self.mark.after(elapsed_us, short, sequence, at);
                self.take_by_number(next, row, elapsed_us, at, report);
                next
            }
            None => match self.take_by_log(contact, row, at, report) {
                Some(next) => next,
                None => return false,
            },
        };
        (self.row, self.newest) = (row, newest);
        if let (Reception::Live, ClockTurn::Known, Some(at)) = (self.reception, self.turn(), at) {
            match &mut self.least {
                Some(least) => least.take(newest.micros, at),
                least => *least = Some(LeastDelay::of(newest.micros, at)),
            }
        }
        true
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

    /// Processes a contact whose number does not agree with its time, so that the log's clock determines the turn.
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
            // If the suspect and this contact agree, the suspect was right, and the mark is out of date.
            let is_after = matches!(elapsed, TimeBetween::Agreed(1..));
            is_after.then(|| suspect.after(elapsed.micros(), short, sequence, at))
        });
        let mut elapsed = self.mark.elapsed(short, at);
        if let Some(before) = self.before
            && let TimeBetween::Agreed(nearer) = before.elapsed(short, at)
            && nearer > 0
            && !matches!(elapsed, TimeBetween::Agreed(elapsed) if elapsed < nearer)
        {
            report.count_problem("times_against_the_log");
            (self.mark, elapsed) = (before, TimeBetween::Agreed(nearer));
        }
        if elapsed == TimeBetween::Agreed(0) && numbers == 0 {
            report.duplicates += 1;
            return None;
        }
        if self.reception == Reception::Live {
            // Queued frames are received all at once, so their times of reception cannot show that a contact is older.
            elapsed = elapsed.forward();
        }
        let next = match (elapsed, after_suspect) {
            (TimeBetween::Contradicted(_), Some(next)) => next,
            _ => self.mark.after(elapsed.micros(), short, sequence, at),
        };
        let is_back = matches!(elapsed, TimeBetween::Agreed(elapsed) if elapsed < 0);
        // A restart sets both time and number back. If only the time goes back, the time is wrong.
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
        if let (TimeBetween::Contradicted(_), None) = (elapsed, after_suspect) {
            report.count_problem("times_against_the_log");
            self.suspect = Some(next);
            return Some(next);
        }
        if is_back {
            report.count_problem("times_that_run_backwards");
        } else if let TimeBetween::Unbridged(_) = elapsed {
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

    /// Counts a contact that arrived after a later one, on whose arrival it was counted as missing.
    fn overtaken(&mut self, report: &mut Report) {
        report.count_problem("contacts_out_of_order");
        self.missing -= 1;
    }

    /// Change of the number of missing contacts since the last call.
    pub(super) const fn take_missing(&mut self) -> i64 {
        std::mem::replace(&mut self.missing, 0)
    }

    /// Marks the turn as not yet known from `row` on. Its contact is `elapsed_us` later than the previous one.
    fn doubt(&mut self, row: usize, elapsed_us: i64, numbers: u8, missing: i64) {
        let before = self.gap.map_or(ClockTurn::Known, |gap| gap.before);
        self.gap = Some(Gap { row, before, elapsed_us, numbers, missing });
    }

    /// Processes the clock in a health frame, which follows the newest contact.
    pub(super) fn read_clock(
        &mut self,
        reading: ClockReading,
        report: &mut Report,
    ) -> ClockCorrection {
        let ahead = self.newest.behind(reading);
        let Some(gap) = self.gap.take() else {
            let shift_us = ahead.nearest_us();
            if shift_us == 0 {
                return ClockCorrection::None;
            }
            // The contact looked like the next one, but either a multiple of 256 contacts was lost in whole turns, or the
            // foot has restarted.
            self.shift(shift_us);
            if shift_us < 0 {
                return self.restart(self.row, shift_us);
            }
            report.count_problem("turns_that_were_wrong");
            self.count_missing(self.pace.missing(shift_us, 0), report);
            report.count_step(0, shift_us.unsigned_abs());
            return ClockCorrection::Turn(self.row, shift_us);
        };
        if gap.before == ClockTurn::NotYet {
            let shift_us = ahead.first_us();
            self.shift(shift_us);
            return ClockCorrection::Turn(gap.row, shift_us);
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
        ClockCorrection::Turn(gap.row, shift_us)
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

    fn restart(&mut self, from: usize, shift_us: i64) -> ClockCorrection {
        self.alignment = SyncAlignment::default();
        ClockCorrection::Restart(from, shift_us)
    }

    /// Aligns the clock with the log's if a health frame reports a SYNC. Returns the offset from the foot's
    /// clock to the log's, µs, if known.
    pub(super) fn align(&mut self, reading: ClockReading, syncs: &Syncs) -> Option<i64> {
        let time = self.newest.time_of(reading)?;
        self.alignment.take(reading, time, syncs, self.least);
        self.offset()
    }

    /// Offset from the foot's clock to the log's, µs, if known from SYNCs.
    fn offset(&self) -> Option<i64> {
        let offset = self.alignment.offset()?;
        // A contact cannot have been made after its reception, which limits the offset.
        let latest = self.least.map(LeastDelay::offset_us);
        Some(latest.map_or(offset, |latest| offset.min(latest)))
    }

    /// Converts a time of the foot's clock, µs, to the log's, if the offset is known from SYNCs.
    pub(super) fn common(&self, micros: u64) -> Option<(Timestamp, CommonClock)> {
        let common = micros.checked_add_signed(self.offset()?)?;
        Some((Timestamp::from_micros(common), CommonClock::Sync))
    }
}

/// Time between two frames beyond which the log's clock is assumed to have been set, µs: one day.
const LONGEST_BRIDGE_US: i64 = 86_400_000_000;

/// Largest step back of frames out of order, µs; a larger one means that the log's clock was set back.
const LONGEST_RETURN_US: i64 = -1_000_000;

/// Limit of a step back if the log has no times, µs. A step that falls short of a full turn by less than this limit
/// is a frame that was overtaken.
const OVERTAKEN_US: i64 = TURN_US / 8;

/// Permitted difference between the clocks of foot and log, µs, because frames wait in adapters and queues.
const TOLERANCE_US: i64 = TURN_US / 4;

/// Step and turn of the foot's short clock, µs.
const STEP_US: i64 = TIME_STEP_US as i64;
const TURN_US: i64 = STEP_US << 16;

/// Time and number of a contact.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    /// Time on the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    /// Short time of its frame.
    pub(super) short: ShortTime,
    sequence: u8,
    /// Time in the log, µs; `None` if the log has no times.
    logged_us: Option<u64>,
}

/// Time between two contacts on the foot's clock, and whether the log's clock agrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TimeBetween {
    /// Both clocks agree on this time, µs.
    Agreed(i64),
    /// The nearest time that the foot's clock allows, µs, is far from the log's.
    Contradicted(i64),
    /// The log's clock was set in between. Only the time on the foot's clock is known, µs, less than a turn.
    Unbridged(i64),
}

impl TimeBetween {
    /// Time on the foot's clock, µs.
    const fn micros(self) -> i64 {
        let (Self::Agreed(elapsed) | Self::Contradicted(elapsed) | Self::Unbridged(elapsed)) = self;
        elapsed
    }

    /// Returns whether both clocks agree on a time forwards of less than half a turn.
    fn is_within_a_turn(self) -> bool {
        matches!(self, Self::Agreed(elapsed) if (0..TURN_US / 2).contains(&elapsed))
    }

    /// Takes the time as agreed: unchanged, or as the next time on the short clock that is not negative.
    fn forward(self) -> Self {
        Self::Agreed(match self.micros() {
            elapsed @ ..0 => elapsed.rem_euclid(TURN_US),
            elapsed => elapsed,
        })
    }
}

/// Difference of a foot's full clock from the counted time of a contact, in steps modulo 2³²: whole turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ahead(u32);

impl Ahead {
    /// Difference from a time that counts from an assumed turn, µs: at least 0.
    fn first_us(self) -> i64 {
        i64::from(self.0) * STEP_US
    }

    /// Difference from a time that is off by a whole number of turns, µs: less than six hours.
    fn nearest_us(self) -> i64 {
        i64::from(self.0 as i32) * STEP_US
    }
}

impl Mark {
    /// Creates the mark of a foot's first contact. The short clock is assumed to be in its first turn.
    fn first(short: ShortTime, sequence: u8, at: Option<Timestamp>) -> Self {
        Self {
            micros: u64::from(short.0) * TIME_STEP_US,
            short,
            sequence,
            logged_us: at.map(Timestamp::as_micros),
        }
    }

    /// A contact `elapsed` µs later.
    fn after(self, elapsed: i64, short: ShortTime, sequence: u8, at: Option<Timestamp>) -> Self {
        Self {
            micros: self.micros.saturating_add_signed(elapsed),
            ..Self::first(short, sequence, at)
        }
    }

    /// Time to a contact at `short`, µs, negative if the contact is older; `None` unless its number agrees
    /// with its time at the foot's `pace`. If they agree, no turn of the clock is missing in between, because
    /// a turn would need a loss of a multiple of 256 contacts that lasts whole turns: 16.384 s at 1 kHz.
    fn by_number(self, short: ShortTime, sequence: u8, pace: ContactPace) -> Option<i64> {
        let contacts = i64::from(sequence.wrapping_sub(self.sequence) as i8);
        let steps = self.steps_us(short);
        let elapsed = if contacts < 0 { steps - TURN_US } else { steps };
        (contacts != 0 && pace.agrees(elapsed, contacts)).then_some(elapsed)
    }

    /// Time to a contact at `short`, logged at `at`. The foot's clock wraps every 655.36 ms; the log's clock
    /// determines the turn, forwards or backwards. If the log has no times, the time is less than a turn.
    fn elapsed(self, short: ShortTime, at: Option<Timestamp>) -> TimeBetween {
        let steps = self.steps_us(short);
        let (Some(at), Some(before)) = (at, self.logged_us) else {
            let turns = i64::from(steps > TURN_US - OVERTAKEN_US);
            return TimeBetween::Agreed(steps - turns * TURN_US);
        };
        // Signed: a log may run backwards.
        let logged = at.as_micros().wrapping_sub(before) as i64;
        if !(LONGEST_RETURN_US..LONGEST_BRIDGE_US).contains(&logged) {
            return TimeBetween::Unbridged(steps);
        }
        let turns = (logged - steps + TURN_US / 2).div_euclid(TURN_US);
        let elapsed = steps + turns * TURN_US;
        if (elapsed - logged).abs() <= TOLERANCE_US {
            TimeBetween::Agreed(elapsed)
        } else {
            TimeBetween::Contradicted(elapsed)
        }
    }

    /// Returns whether the log's clock advanced by about `elapsed` to `at`, µs; true if the log has no times.
    fn is_logged_after(self, elapsed: i64, at: Option<Timestamp>) -> bool {
        let (Some(at), Some(before)) = (at, self.logged_us) else {
            return true;
        };
        let logged = at.as_micros().wrapping_sub(before) as i64;
        logged.abs_diff(elapsed) <= TOLERANCE_US.unsigned_abs()
    }

    /// Difference of the full clock in `reading`, less than half a turn from this contact, from its counted time.
    const fn behind(self, reading: ClockReading) -> Ahead {
        let since = self.short.0.wrapping_sub(reading.time.short().0) as i16;
        let full = reading.time.0.wrapping_add_signed(since as i32);
        Ahead(full.wrapping_sub((self.micros / TIME_STEP_US) as u32))
    }

    /// Moves the counted time by whole turns, µs.
    const fn shift(&mut self, shift_us: i64) {
        self.micros = self.micros.saturating_add_signed(shift_us);
    }

    /// Counted time of `reading`, µs, which is less than half a turn from this contact.
    fn time_of(self, reading: ClockReading) -> Option<u64> {
        let since = reading.time.short().0.wrapping_sub(self.short.0) as i16;
        self.micros.checked_add_signed(i64::from(since) * STEP_US)
    }

    /// Time to `short` within a turn of the short clock, µs.
    fn steps_us(self, short: ShortTime) -> i64 {
        i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US
    }
}

/// Largest number of contacts over which the period is averaged; the smallest is half of it. A single period varies by
/// a sixth, because its time is the time of the sensor's edge.
const AVERAGED: u64 = 2048;

/// Longest time to the contact with the next number, in periods; a longer time is a pause of the foot.
const MOST_PERIODS: i64 = 8;

/// Modulus of the sequence numbers.
const NUMBERS: i64 = 1 << 8;

/// Mean period of the contacts of a foot, which gives the number of contacts made in a given time.
#[derive(Clone, Copy, Debug, Default)]
struct ContactPace {
    elapsed_us: u64,
    contacts: u64,
}

impl ContactPace {
    /// Adds a number of contacts made within `elapsed_us`.
    const fn take(&mut self, elapsed_us: u64, contacts: u64) {
        self.elapsed_us += elapsed_us;
        self.contacts += contacts;
        if self.contacts >= AVERAGED {
            self.elapsed_us /= 2;
            self.contacts /= 2;
        }
    }

    /// Returns whether no contacts have been added.
    const fn is_unknown(self) -> bool {
        self.contacts == 0
    }

    /// Starts from the time between two consecutive contacts, if the pace is unknown.
    fn take_first(&mut self, elapsed_us: i64) {
        if self.is_unknown() && elapsed_us > 0 {
            self.take(elapsed_us.unsigned_abs(), 1);
        }
    }

    /// Returns whether a contact may be `contacts` after another (before it, if negative), given a time of `elapsed_us`
    /// between them. The tolerance is half a period plus a change of the pace by 1/256. If `contacts` is 1, the time may be
    /// up to [`MOST_PERIODS`] periods, because an edge of the sensor may be late.
    fn agrees(self, elapsed_us: i64, contacts: i64) -> bool {
        let expected_us = |contacts| {
            let mean_us = i64::try_from(self.elapsed_us).ok()?;
            let averaged = i64::try_from(self.contacts).ok()?;
            mean_us.saturating_mul(contacts).checked_div(averaged)
        };
        let (Some(period_us), Some(expected_us)) = (expected_us(1), expected_us(contacts)) else {
            return false;
        };
        let tolerance_us = period_us / 2 + expected_us.abs() / 256;
        match contacts {
            1 => (1..=MOST_PERIODS * period_us).contains(&elapsed_us),
            _ => (expected_us - elapsed_us).abs() <= tolerance_us,
        }
    }

    /// Returns the number of contacts missing in `elapsed_us`, in which the sequence number has advanced by `numbers`. The
    /// pace gives the number of contacts approximately, the sequence number exactly but modulo 256. If the sequence number
    /// is the next one although the pace contradicts it, the foot has paused and nothing is missing.
    fn missing(self, elapsed_us: i64, numbers: u8) -> i64 {
        let modulo = i64::from(numbers.wrapping_sub(1));
        let Some(made) = self.contacts_in(elapsed_us) else {
            return modulo;
        };
        let difference =
            (i64::from(numbers) - made + NUMBERS / 2).rem_euclid(NUMBERS) - NUMBERS / 2;
        if numbers == 1 && difference.abs() > 2 + made / 256 {
            return 0;
        }
        (made + difference - 1).max(modulo)
    }

    /// Number of contacts made in `elapsed_us`, rounded; `None` if the pace is unknown.
    fn contacts_in(self, elapsed_us: i64) -> Option<i64> {
        let elapsed = i128::from(elapsed_us) * i128::from(self.contacts);
        let period = i128::from(self.elapsed_us);
        let contacts = (elapsed + period / 2).checked_div_euclid(period)?;
        i64::try_from(contacts).ok()
    }
}

/// Number of differences in the median. At ten health frames a second they span less than two seconds, in
/// which clocks that are 50 ppm apart drift by 80 µs.
const DIFFERENCES: usize = 15;

/// Time by which a contact may undercut the least delay so far, µs.
const SOONER_US: i64 = 50_000;

/// Change of the difference that means a clock was set or restarted, µs.
const LARGEST_STEP_US: u64 = 100_000;

/// Time of reception of the newest SYNC of each number.
pub(super) type Syncs = BTreeMap<u8, Timestamp>;

/// Offset from the clock of a foot to the clock of the log, by numbered SYNCs, which reach all nodes at the same moment.
///
/// The log holds the time of reception of the SYNC, the foot reports the time on its own clock, both with the SYNC's
/// number. The difference is the offset to add to the foot's clock. It includes the delay of the reception, which varies,
/// so the median of several differences is used.
#[derive(Clone, Debug, Default)]
struct SyncAlignment {
    /// Recent differences, µs, newest last.
    differences: Vec<i64>,
    /// The last SYNC that the foot reported; it reports each several times.
    newest: Option<ClockReading>,
}

impl SyncAlignment {
    /// Processes a clock that the foot reports, which is `micros` on its counted clock, if it was read at a SYNC.
    /// `least` is the least delay of frames received live, in which case a delayed SYNC is ignored.
    fn take(
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
    fn offset(&self) -> Option<i64> {
        let mut sorted = self.differences.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}
