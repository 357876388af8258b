//! Journal of updates: records of two words in one sector, appended until the sector is full.
//!
//! | word | contents |
//! |---|---|
//! | 0 | bits 0 to 7 the [event](Event), bits 8 to 15 its detail, bits 16 to 31 zero |
//! | 1 | complement of word 0 |
//!
//! A record that a power cut interrupted does not match its complement, and does not count. But its bits can be weak:
//! they read as valid at one start, and as interrupted or blank at the next. So before anything rests on the last record,
//! and before the next one is written, the last record is written again, and what may be an interrupted record behind it
//! is made invalid ([`State::make_firm`]).
//!
//! The journal is erased when it is nearly full, and then begins with its last state. Before the erase all used words
//! are set to zero, those of the first record first, so that an interrupted erase leaves no valid record. A blank
//! journal beside a program that was sent or is marked is the remainder of an interrupted erase, because such a program
//! has had records. Its bits may be weak, so it is erased again.
//!
//! A confirmed program is also marked in its own slot, in the last word of its header. The mark is written before an
//! install, before the previous program is overwritten, and before an erase of the journal. It is erased with its
//! program. A marked program is never on trial, whatever happened to the journal. A program that was sent, without mark
//! and record, is on trial. So a power cut during the erase never makes an untried program the settled one.

use crate::flash::{Flash, FlashFailed, JOURNAL, JOURNAL_SIZE, Sector, Slot};
use crate::image::{MARK, Refusal};

/// Size of a record, bytes.
const RECORD: u32 = 8;

/// Number of records.
const RECORDS: u32 = JOURNAL_SIZE / RECORD;

/// First record of a journal whose erase has begun.
const ERASING: (u32, u32) = (0, 0);

/// Number of records that must be free for an update, otherwise the journal is erased.
const RESERVE: u32 = 64;

/// Number of records that an update or a trial in progress needs.
const LEAST: u32 = 8;

/// Number of records in which the write of an event is tried.
const ATTEMPTS: u32 = 4;

/// Address of the mark of a confirmed program.
const MARK_ADDRESS: u32 = Slot::Running.start() + MARK as u32;

/// Number of starts of a new program without its confirmation after which the previous one is restored.
pub const MOST_STARTS: u8 = 3;

/// An event of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The program in [`Slot::New`] is to be copied and started.
    Install,
    /// The program to return to, if there is one, is whole in [`Slot::Previous`]. The new program may replace the
    /// running one.
    Kept,
    /// The new program is started without having been confirmed.
    Started,
    /// The running program works.
    Confirmed,
    /// The previous program is to be restored, for this reason.
    Restore(Refusal),
    /// The update was not begun, or the previous program has been restored.
    Ended(Refusal),
}

impl Event {
    fn encode(self) -> u32 {
        let (number, detail) = match self {
            Self::Install => (1, 0),
            Self::Started => (2, 0),
            Self::Confirmed => (3, 0),
            Self::Restore(why) => (4, why.number()),
            Self::Ended(why) => (5, why.number()),
            Self::Kept => (6, 0),
        };
        u32::from_le_bytes([number, detail, 0, 0])
    }

    fn decode(word: u32) -> Option<Self> {
        let [number, detail, 0, 0] = word.to_le_bytes() else {
            return None;
        };
        Some(match number {
            1 => Self::Install,
            2 => Self::Started,
            3 => Self::Confirmed,
            4 => Self::Restore(Refusal::from_number(detail)?),
            5 => Self::Ended(Refusal::from_number(detail)?),
            6 => Self::Kept,
            _ => return None,
        })
    }
}

const fn address(record: u32) -> u32 {
    JOURNAL + record * RECORD
}

fn is_blank(flash: &impl Flash, record: u32) -> bool {
    let at = address(record);
    (flash.read(at), flash.read(at + 4)) == (u32::MAX, u32::MAX)
}

/// Writes a record.
fn write(flash: &mut impl Flash, record: u32, word: u32) -> Result<(), FlashFailed> {
    let at = address(record);
    flash.program(at, word)?;
    flash.program(at + 4, !word)
}

/// Sets the event of a record to zero. Such a record is never valid, whatever its complement.
fn void(flash: &mut impl Flash, record: u32) -> Result<(), FlashFailed> {
    flash.program(address(record), 0)
}

/// Event of a record; `None` for an interrupted record.
fn event(word: u32, complement: u32) -> Option<Event> {
    (complement == !word).then(|| Event::decode(word)).flatten()
}

/// Returns whether the running program is marked as confirmed. The mark is a word of zeros in erased flash, and the
/// majority of its bits decides.
pub fn is_marked(flash: &impl Flash) -> bool {
    flash.read(MARK_ADDRESS).count_zeros() > u32::BITS / 2
}

/// Marks the running program, if there is one, as confirmed. Writes an existing mark again, because a power cut can
/// have left it weak.
///
/// # Errors
/// The flash failed, and the program is not marked.
pub fn mark(flash: &mut impl Flash) -> Result<(), FlashFailed> {
    if flash.read(Slot::Running.start()) == u32::MAX {
        return Ok(());
    }
    let written = flash.program(MARK_ADDRESS, 0);
    if is_marked(flash) { Ok(()) } else { written }
}

/// Progress of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Progress {
    /// The running program is confirmed, or was written by a probe.
    #[default]
    Settled,
    /// The new program is to be checked, and the running one is being copied.
    Installing,
    /// The new program is being copied. The content of the running slot has not been tried.
    Replacing,
    /// The new program has been started this many times without confirmation.
    Trial(u8),
    /// The previous program is being copied back.
    Restoring(Refusal),
}

/// State in a journal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Progress of the last update.
    pub progress: Progress,
    /// Reason why the last update failed; `None` if it succeeded.
    pub refusal: Option<Refusal>,
    /// Number of starts of an unconfirmed running program while an update is in progress. Such a program is never kept.
    pub trial: Option<u8>,
    /// Number of records up to the last event, including damaged ones.
    used: u32,
    /// Number of blank records behind the last event.
    free: u32,
    /// Last event.
    last: Option<Event>,
    /// Whether the end of the journal will read the same at the next start.
    is_firm: bool,
    /// Whether the journal has no event but must have had one, as after an interrupted erase.
    is_torn: bool,
}

impl State {
    /// Reads the journal. A record that reads as blank does not end the journal, because a record with weak bits after a
    /// power cut can read as blank.
    #[must_use]
    pub fn read(flash: &impl Flash) -> Self {
        let mut state = Self::default();
        let is_marked = is_marked(flash);
        // The kind of a program that was sent has the number 1.
        let is_sent = matches!(flash.read(Slot::Running.start() + 8).to_le_bytes(), [_, 1, ..]);
        if is_sent {
            state.progress = Progress::Trial(0);
        }
        for index in 0..RECORDS {
            let at = address(index);
            let (word, complement) = (flash.read(at), flash.read(at + 4));
            if let Some(event) = event(word, complement) {
                (state.used, state.free) = (index + 1, 0);
                state.apply(event);
            } else if (word, complement) == (u32::MAX, u32::MAX) {
                state.free += 1;
            } else if index == 0 && (word, complement) == ERASING {
                state.is_torn = true;
                break;
            }
        }
        let has_had_records = state.free < RECORDS || is_sent || is_marked;
        state.is_torn |= state.used == 0 && has_had_records;
        if is_marked {
            state.trial = None;
            if let Progress::Trial(_) = state.progress {
                state.progress = Progress::Settled;
            }
        }
        state
    }

    fn apply(&mut self, event: Event) {
        self.last = Some(event);
        match event {
            Event::Install => {
                match self.progress {
                    Progress::Trial(starts) => self.trial = Some(starts),
                    // The trial of the running program is over, so it cannot be the program to return to.
                    Progress::Restoring(_) => self.trial = Some(MOST_STARTS),
                    Progress::Settled | Progress::Installing | Progress::Replacing => {}
                }
                self.progress = Progress::Installing;
            }
            Event::Kept => (self.progress, self.trial) = (Progress::Replacing, Some(MOST_STARTS)),
            Event::Started => {
                self.trial = None;
                self.progress = Progress::Trial(match self.progress {
                    Progress::Trial(starts) => starts.saturating_add(1),
                    _ => 1,
                });
            }
            Event::Confirmed => {
                (self.progress, self.refusal, self.trial) = (Progress::Settled, None, None);
            }
            Event::Restore(why) => {
                (self.progress, self.trial) = (Progress::Restoring(why), None);
            }
            Event::Ended(why) => {
                self.refusal = Some(why);
                self.progress = match (self.progress, self.trial.take()) {
                    // A record can count twice if its first attempt was interrupted.
                    (Progress::Settled | Progress::Trial(_), _) => self.progress,
                    // The new program was refused, and the running one is on trial as before.
                    (_, Some(starts)) => Progress::Trial(starts),
                    (_, None) => Progress::Settled,
                };
            }
        }
    }

    /// Makes the end of the journal read the same at each start from now on. Writes the last record again, and sets the
    /// events behind it to zero, including the first record that reads as blank, because an interrupted record can read
    /// as blank.
    ///
    /// # Errors
    /// The flash failed.
    pub fn make_firm(&mut self, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        if self.is_firm {
            return Ok(());
        }
        if let (Some(event), Some(index)) = (self.last, self.used.checked_sub(1)) {
            write(flash, index, event.encode())?;
        }
        for index in self.used..RECORDS {
            let was_blank = is_blank(flash, index);
            // A failure is ignored, because a bad cell makes no valid record.
            let _ = void(flash, index);
            self.used = index + 1;
            if was_blank {
                self.free = self.free.saturating_sub(1);
                break;
            }
        }
        self.is_firm = true;
        Ok(())
    }

    /// Appends an event in the next blank record, after making the previous one firm. Programs at least two words, and
    /// more if a bad cell does not take them. Erases nothing.
    ///
    /// # Errors
    /// The journal is full, or the flash failed.
    pub fn append(&mut self, event: Event, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        self.make_firm(flash)?;
        for _ in 0..ATTEMPTS {
            // A bad cell never reads as blank.
            let blank = (self.used..RECORDS).find(|index| is_blank(flash, *index));
            let index = blank.ok_or(FlashFailed)?;
            self.used = index + 1;
            self.free = self.free.saturating_sub(1);
            if write(flash, index, event.encode()).is_ok() {
                self.apply(event);
                return Ok(());
            }
        }
        Err(FlashFailed)
    }

    /// Requests the install of the program in [`Slot::New`]. Marks a confirmed program first.
    ///
    /// # Errors
    /// The flash failed.
    pub fn install(&mut self, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        self.tidy(flash)?;
        self.mark_confirmed(flash)?;
        self.append(Event::Install, flash)
    }

    /// Erases a journal that is nearly full, or whose erase was interrupted. The journal begins again with its state. A
    /// power cut before that never makes an untried program the settled one. At worst an update is lost, or a trial
    /// begins again.
    ///
    /// # Errors
    /// The flash failed.
    pub fn tidy(&mut self, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        let least = if self.progress == Progress::Settled { RESERVE } else { LEAST };
        if !self.is_torn && self.free >= least {
            return Ok(());
        }
        self.mark_confirmed(flash)?;
        let (word, complement) = ERASING;
        flash.program(JOURNAL, word)?;
        flash.program(JOURNAL + 4, complement)?;
        for at in (JOURNAL + RECORD..JOURNAL + JOURNAL_SIZE).step_by(4) {
            if flash.read(at) != u32::MAX {
                // A failure is ignored, because a bad cell makes no valid record.
                let _ = flash.program(at, 0);
            }
        }
        flash.erase(Sector::Journal)?;
        let before = core::mem::replace(self, Self::read(flash));
        let starts = match before.progress {
            Progress::Trial(starts) => starts,
            Progress::Installing => before.trial.unwrap_or(0),
            Progress::Settled | Progress::Replacing | Progress::Restoring(_) => 0,
        };
        for _ in 0..starts {
            self.append(Event::Started, flash)?;
        }
        if before.is_confirmed() {
            self.append(Event::Confirmed, flash)?;
        }
        match before.progress {
            Progress::Settled => {
                if let Some(why) = before.refusal {
                    self.append(Event::Ended(why), flash)?;
                }
            }
            Progress::Trial(_) => {}
            Progress::Installing => self.append(Event::Install, flash)?,
            Progress::Replacing => self.append(Event::Kept, flash)?,
            Progress::Restoring(why) => self.append(Event::Restore(why), flash)?,
        }
        Ok(())
    }

    /// Returns whether the journal states that the running program is confirmed.
    const fn is_confirmed(&self) -> bool {
        match self.progress {
            Progress::Settled => true,
            Progress::Installing => self.trial.is_none(),
            Progress::Trial(_) | Progress::Replacing | Progress::Restoring(_) => false,
        }
    }

    fn mark_confirmed(&self, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        if self.is_confirmed() { mark(flash) } else { Ok(()) }
    }
}
