//! State of a foot in a log: time and number of its next contact.

use estimator_core::Timestamp;
use wire::pdo::{Contact, LastSync, ShortTime};
use wire::sequence::missing_u8;

use super::Reception;
use super::clock::{Elapsed, Mark};
use super::sync::{Alignment, Syncs};
use super::turns::{Correction, Next, Step, Turns, Waiting};
use crate::report::Report;
use crate::row::Clock;

/// The state of a foot in a log.
#[derive(Clone)]
pub(super) struct LoggedFoot {
    /// Row of its newest contact; other frames of the foot complete this row.
    pub(super) row: usize,
    /// Short time of that row.
    pub(super) short: ShortTime,
    /// Time of that row on the foot's clock, µs.
    pub(super) micros: u64,
    /// Offset of its clock from the log's.
    alignment: Alignment,
    /// Newest contact whose time agrees with the log.
    mark: Mark,
    /// The contact before `mark`, used if the log's time of `mark` was wrong.
    before: Option<Mark>,
    /// A newer contact whose time contradicts the log, if it was the last.
    suspect: Option<Mark>,
    /// Newest sequence number.
    sequence: u8,
    /// Time from the previous contact to the newest, µs; 0 if unknown.
    usual_us: i64,
    /// State for live contacts, which may have been delayed; the fields from `before` on are then unused.
    live: Option<Turns>,
}

impl LoggedFoot {
    /// A foot whose first contact, logged at `at`, becomes `row`.
    pub(super) fn new(
        contact: &Contact,
        row: usize,
        at: Option<Timestamp>,
        reception: Reception,
    ) -> Self {
        let live = match (reception, at) {
            (Reception::Live, Some(at)) => {
                Some(Turns::new(contact.timestamp, contact.sequence, at))
            }
            _ => None,
        };
        Self {
            row,
            short: contact.timestamp,
            micros: 0,
            alignment: Alignment::default(),
            mark: Mark::first(contact.timestamp, at),
            before: None,
            suspect: None,
            sequence: contact.sequence.wrapping_sub(1),
            usual_us: 0,
            live,
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
        if let (Some(mut turns), Some(at)) = (self.live, at) {
            let micros = self.take_live(&mut turns, contact, row, at, report);
            self.live = Some(turns);
            return micros;
        }
        let Contact {
            timestamp: short,
            sequence,
            ..
        } = *contact;
        let missing = missing_u8(self.sequence, sequence);
        let after_suspect = self.suspect.take().and_then(|suspect| {
            match suspect.elapsed(short, at) {
                // The two contacts agree, so the mark is out of date.
                Elapsed::Agreed(elapsed) if elapsed > 0 => Some(suspect.after(elapsed, short, at)),
                _ => None,
            }
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
        if missing == 0 {
            elapsed = self.mark.elapsed_to_next(elapsed, short, self.usual_us);
        }
        let mark = match (elapsed, after_suspect) {
            (Elapsed::Agreed(0), _) if missing == u8::MAX => {
                report.duplicates += 1;
                return None;
            }
            (Elapsed::Contradicted(_), Some(mark)) => mark,
            (
                Elapsed::Agreed(elapsed)
                | Elapsed::Contradicted(elapsed)
                | Elapsed::Unbridged(elapsed),
                _,
            ) => self.mark.after(elapsed, short, at),
        };
        let is_back = matches!(elapsed, Elapsed::Agreed(elapsed) if elapsed < 0);
        // Both time and number must go back: if only the time does, it is wrong.
        let is_late = is_back && missing >= 1 << 7;
        match elapsed {
            Elapsed::Agreed(_) if is_late => report.count_problem("contacts_out_of_order"),
            Elapsed::Contradicted(_) if after_suspect.is_none() => {
                report.count_problem("times_against_the_log");
                self.suspect = Some(mark);
            }
            _ => {
                if is_back {
                    report.count_problem("times_that_run_backwards");
                } else if let Elapsed::Unbridged(_) = elapsed {
                    report.count_problem("clock_of_the_log_set");
                }
                if self.row != row {
                    report.count_step(self.mark.micros, mark.micros);
                }
                if let Elapsed::Agreed(step) = elapsed {
                    self.usual_us = step;
                }
                self.before = (self.row != row && after_suspect.is_none()).then_some(self.mark);
                self.mark = mark;
            }
        }
        if !is_late {
            report.count_missing(u64::from(missing));
            self.sequence = sequence;
        }
        self.row = row;
        self.short = short;
        self.micros = mark.micros;
        Some(mark.micros)
    }

    /// Processes the next live contact.
    fn take_live(
        &mut self,
        turns: &mut Turns,
        contact: &Contact,
        row: usize,
        at: Timestamp,
        report: &mut Report,
    ) -> Option<u64> {
        let Next {
            micros,
            step,
            waiting,
        } = if self.row == row {
            Next::first(turns.micros)
        } else {
            turns.take(contact.timestamp, contact.sequence, at)
        };
        match step {
            Step::Duplicate => {
                report.duplicates += 1;
                return None;
            }
            Step::Late => report.count_problem("contacts_out_of_order"),
            Step::Forward(missing) => {
                report.count_missing(missing);
                if self.row != row {
                    report.count_step(self.mark.micros, micros);
                }
                self.mark = Mark::of(micros, contact.timestamp, at);
            }
        }
        match waiting {
            Waiting::Begins => report.count_problem("contacts_that_waited"),
            Waiting::Unknown => report.count_problem("clock_of_the_log_set"),
            Waiting::No | Waiting::Still => {}
        }
        self.row = row;
        self.short = contact.timestamp;
        self.micros = micros;
        Some(micros)
    }

    /// Processes the SYNC reported by a health frame of a live foot: the long clock corrects the counted one.
    /// Errors are counted in the report.
    pub(super) fn verify(&mut self, sync: LastSync, report: &mut Report) -> Correction {
        let Some(turns) = &mut self.live else {
            return Correction::None;
        };
        let correction = turns.health(sync);
        if let Correction::Turns { missing, gap_us } = correction {
            report.correct_missing(missing);
            report.count_step(0, gap_us.unsigned_abs());
            report.count_problem("turns_that_were_wrong");
            let at = self.mark.logged();
            self.micros = turns.micros;
            self.mark = Mark::of(turns.micros, self.short, at);
        }
        correction
    }

    /// Processes the newest SYNC that the foot reports. Returns the offset from its clock to the log's, µs,
    /// if known.
    pub(super) fn align(&mut self, sync: LastSync, syncs: &Syncs) -> Option<i64> {
        self.alignment
            .take(sync, syncs, self.mark, self.live.as_ref());
        self.offset()
    }

    /// Offset from its clock to the log's, µs, if known from SYNCs.
    fn offset(&self) -> Option<i64> {
        let offset = self.alignment.offset()?;
        Some(match &self.live {
            Some(turns) => turns.at_most(offset),
            None => offset,
        })
    }

    /// Converts a time of its clock, µs, to the log's, if the offset is known from SYNCs.
    pub(super) fn common(&self, micros: u64) -> Option<(Timestamp, Clock)> {
        let common = micros.checked_add_signed(self.offset()?)?;
        Some((Timestamp::from_micros(common), Clock::Sync))
    }
}
