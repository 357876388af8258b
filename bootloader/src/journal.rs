//! Journal of updates: records of two words in one sector, appended until the sector is full.
//!
//! | word | contents |
//! |---|---|
//! | 0 | bits 0 to 7 the [event](Event), bits 8 to 15 its detail, bits 16 to 31 zero |
//! | 1 | complement of word 0 |
//!
//! A record that a power cut interrupted has another complement, and does not count. The journal is erased where it
//! is nearly full, and begins with its last state. Before the erase both words of the first record become zero: what an
//! interrupted erase leaves behind it does not count. Without a record a program that was sent is on trial: a power cut
//! in the erase makes no untried program the settled one.

use crate::flash::{Flash, FlashFailed, JOURNAL, JOURNAL_SIZE, Sector, Slot};
use crate::image::Refusal;

/// Size of a record, bytes.
const RECORD: u32 = 8;

/// Number of records.
const RECORDS: u32 = JOURNAL_SIZE / RECORD;

/// First record of a journal that is being erased.
const ERASING: (u32, u32) = (0, 0);

/// Number of records that are kept free for an update when the journal is erased.
const RESERVE: u32 = 64;

/// Number of records that a trial and the next update need.
const LEAST: u32 = 8;

/// Starts of a new program without its confirmation, after which the previous one is restored.
pub const MOST_STARTS: u8 = 3;

/// An event of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The program in [`Slot::New`] is to be copied and started.
    Install,
    /// The program to return to, if there is one, is whole in [`Slot::Previous`]: the new program may replace the running
    /// one.
    Kept,
    /// The new program is started, without having been confirmed.
    Started,
    /// The running program works.
    Confirmed,
    /// The previous program is to be restored, for this reason.
    Restore(Refusal),
    /// The update was not begun, or the previous program is restored.
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

/// Event of a record; `None` for one that was interrupted.
fn event(word: u32, complement: u32) -> Option<Event> {
    (complement == !word).then(|| Event::decode(word)).flatten()
}

/// Progress of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Progress {
    /// The running program is confirmed, or was written by a probe.
    #[default]
    Settled,
    /// The new program is to be checked, and the running one is being copied.
    Installing,
    /// The new program is being copied: what the running slot holds has not been tried.
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
    /// Reason why the last update failed; `None` after one that succeeded.
    pub refusal: Option<Refusal>,
    /// Starts of a running program that is not confirmed while an update is in progress: it is never kept.
    pub trial: Option<u8>,
    /// Number of records, damaged ones included.
    used: u32,
}

impl State {
    /// Reads the journal up to the first record that is blank.
    #[must_use]
    pub fn read(flash: &impl Flash) -> Self {
        let mut state = Self::default();
        // The kind of a program that was sent.
        if let [_, 1, ..] = flash.read(Slot::Running.start() + 8).to_le_bytes() {
            state.progress = Progress::Trial(0);
        }
        for index in 0..RECORDS {
            let at = JOURNAL + index * RECORD;
            let (word, complement) = (flash.read(at), flash.read(at + 4));
            if (word, complement) == (u32::MAX, u32::MAX) {
                break;
            }
            if index == 0 && (word, complement) == ERASING {
                state.used = RECORDS;
                break;
            }
            state.used = index + 1;
            if let Some(event) = event(word, complement) {
                state.apply(event);
            }
        }
        state
    }

    fn apply(&mut self, event: Event) {
        match event {
            Event::Install => {
                match self.progress {
                    Progress::Trial(starts) => self.trial = Some(starts),
                    // Its trial is over: it is not the one to return to.
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
            Event::Confirmed => (self.progress, self.refusal) = (Progress::Settled, None),
            Event::Restore(why) => {
                (self.progress, self.trial) = (Progress::Restoring(why), None);
            }
            Event::Ended(why) => {
                self.refusal = Some(why);
                self.progress = match self.trial.take() {
                    // The new program was refused, and the running one is on trial as before.
                    Some(starts) => Progress::Trial(starts),
                    None => Progress::Settled,
                };
            }
        }
    }

    /// Appends an event in the next record that is blank. Programs two words, and erases nothing.
    ///
    /// # Errors
    /// The journal is full, or the flash failed.
    pub fn append(&mut self, event: Event, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        // A bad cell is never blank.
        let blank = (self.used..RECORDS).find(|index| {
            let at = JOURNAL + index * RECORD;
            (flash.read(at), flash.read(at + 4)) == (u32::MAX, u32::MAX)
        });
        let index = blank.ok_or(FlashFailed)?;
        let at = JOURNAL + index * RECORD;
        self.used = index + 1;
        let word = event.encode();
        flash.program(at, word)?;
        flash.program(at + 4, !word)?;
        self.apply(event);
        Ok(())
    }

    /// Erases a journal that is nearly full and one whose erase was interrupted. While a program is being installed or
    /// restored a power cut after the erase would forget that, so that only a journal of a trial is erased then.
    ///
    /// # Errors
    /// The flash failed.
    pub fn tidy(&mut self, flash: &mut impl Flash) -> Result<(), FlashFailed> {
        // An interrupted erase leaves records. A bad cell is none: another erase would not change it.
        let mut behind =
            (JOURNAL + self.used * RECORD..JOURNAL + JOURNAL_SIZE).step_by(RECORD as usize);
        let is_torn = behind.any(|at| event(flash.read(at), flash.read(at + 4)).is_some());
        let is_due = match self.progress {
            Progress::Settled => self.used + RESERVE > RECORDS,
            Progress::Trial(_) => self.used + LEAST > RECORDS,
            Progress::Installing | Progress::Replacing | Progress::Restoring(_) => false,
        };
        if is_torn || is_due {
            let (word, complement) = ERASING;
            flash.program(JOURNAL, word)?;
            flash.program(JOURNAL + 4, complement)?;
            flash.erase(Sector::Journal)?;
            let before = core::mem::replace(self, Self::read(flash));
            match before.progress {
                Progress::Settled => {
                    let last = before.refusal.map_or(Event::Confirmed, Event::Ended);
                    self.append(last, flash)?;
                }
                Progress::Replacing => self.append(Event::Kept, flash)?,
                Progress::Trial(starts) => {
                    for _ in 0..starts {
                        self.append(Event::Started, flash)?;
                    }
                }
                Progress::Installing | Progress::Restoring(_) => {}
            }
        }
        Ok(())
    }
}
