//! Steps of an update at the start. A power cut can interrupt each step, and the next start repeats it.
//!
//! | state in the journal | steps at the start |
//! |---|---|
//! | nothing in progress | The running program is checked and started, even if the flash takes no record. If it has decayed, the previous one is restored. |
//! | [`Installing`](Progress::Installing) | The new program is checked, and the running one is copied to `Previous`. If the running program is the new one and is [marked](crate::image::MARK) as confirmed, the update has ended. It also ends if the flash does not take the copy. |
//! | [`Replacing`](Progress::Replacing) | The new program is checked, copied to `Running` and started, and its slot is cleared. If it is lost or the flash fails, the previous one is restored. |
//! | [`Trial`](Progress::Trial) | The new program is started. After three starts the previous one is restored, or the bootloader stays if there is none. A program written by a probe since then is started. |
//! | [`Restoring`](Progress::Restoring) | The previous program is copied to `Running`. |
//!
//! At every moment one of the slots holds a whole program that has worked: `Running` until its copy in `Previous` is
//! complete, then `Previous` until the new program has confirmed itself. No step takes an earlier copy to be complete
//! even if it reads so: a power cut in its last word can have left bits that read differently the next time.

use crate::flash::{Flash, FlashFailed, Slot};
use crate::image::{HEADER, Header, Kind, Refusal};
use crate::journal::{Event, MOST_STARTS, Progress, State, is_marked, mark};
use crate::{program, verify};

/// Result of the steps at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Start the program in [`Slot::Running`].
    Program,
    /// Wait for a program, because none can be started. The reason is `None` if there has been no program.
    Nothing(Option<Refusal>),
}

/// State of the program in [`Slot::Running`] while the bootloader serves its lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgramState {
    /// The program can be started.
    CanRun,
    /// No program can be started, for this reason; `None` if there has been none.
    Missing(Option<Refusal>),
    /// The flash has failed in the steps at the start. The next start repeats them.
    Unsettled,
}

/// Performs the steps that the journal requires. Returns what to start.
///
/// # Errors
/// The flash has failed and takes no record of that. The running slot may hold part of a program, or an
/// untried one. The next start repeats the steps.
pub fn settle(flash: &mut impl Flash, key: &[u8; 32]) -> Result<Start, FlashFailed> {
    let mut state = State::read(flash);
    let settled = state.tidy(flash).and_then(|()| proceed(&mut state, flash, key));
    match settled {
        Err(FlashFailed) if is_unchanged(&state) && is_whole(flash) => Ok(Start::Program),
        settled => settled,
    }
}

/// Returns whether the running slot has the same content as before an update, if any, and no trial of it must be
/// counted. A foot whose supply is too low for the flash then continues with its program.
const fn is_unchanged(state: &State) -> bool {
    match state.progress {
        Progress::Settled | Progress::Trial(0) => true,
        Progress::Installing => state.trial.is_none(),
        Progress::Trial(_) | Progress::Replacing | Progress::Restoring(_) => false,
    }
}

/// Performs the steps with a journal that has room for their records.
fn proceed(
    state: &mut State,
    flash: &mut impl Flash,
    key: &[u8; 32],
) -> Result<Start, FlashFailed> {
    if let Progress::Installing | Progress::Replacing | Progress::Restoring(_) = state.progress {
        // Slots are about to be overwritten.
        state.make_firm(flash)?;
    }
    // Installing, replacing, a trial that is over, and restoring follow each other at most once.
    let mut is_checked = false;
    for _ in 0..5 {
        let next = match state.progress {
            Progress::Installing => match check_new(flash, key) {
                Ok(()) => {
                    is_checked = true;
                    keep(flash, state).unwrap_or(Event::Ended(Refusal::FlashFailed))
                }
                Err(why) => Event::Ended(why),
            },
            Progress::Replacing => {
                // The check is done once per start, because it takes a second.
                let checked = if is_checked { Ok(()) } else { check_new(flash, key) };
                match checked.and_then(|()| replace(flash)) {
                    Ok(()) => Event::Started,
                    Err(why) if program::check(flash, Slot::Previous).is_ok() => {
                        Event::Restore(why)
                    }
                    Err(why) => Event::Ended(why),
                }
            }
            Progress::Restoring(why) => {
                if program::check(flash, Slot::Previous).is_ok() {
                    program::copy(flash, Slot::Previous, Slot::Running)?;
                }
                Event::Ended(why)
            }
            // Only a program that was sent is on trial, so a probe has replaced it.
            Progress::Trial(_) if is_probed(flash) => Event::Confirmed,
            Progress::Trial(starts) if is_whole(flash) => {
                if starts < MOST_STARTS {
                    state.append(Event::Started, flash)?;
                    return Ok(Start::Program);
                }
                if program::check(flash, Slot::Previous).is_err() {
                    return Ok(Start::Nothing(Some(Refusal::NotConfirmed)));
                }
                Event::Restore(Refusal::NotConfirmed)
            }
            Progress::Settled if is_whole(flash) => return Ok(Start::Program),
            Progress::Trial(_) | Progress::Settled => {
                if program::check(flash, Slot::Previous).is_err() {
                    let was_there = !program::is_blank(flash, Slot::Running);
                    return Ok(Start::Nothing(was_there.then_some(Refusal::Decayed)));
                }
                Event::Restore(Refusal::Decayed)
            }
        };
        state.append(next, flash)?;
        if next == Event::Started {
            // The next download then finds the slot cleared. If this fails, the bootloader clears it.
            let _ = program::clear(flash, Slot::New);
            return Ok(Start::Program);
        }
    }
    Ok(Start::Nothing(None))
}

fn is_whole(flash: &impl Flash) -> bool {
    program::check(flash, Slot::Running).is_ok()
}

fn is_probed(flash: &impl Flash) -> bool {
    program::header(flash, Slot::Running).is_ok_and(|header| header.kind == Kind::Probed)
        && is_whole(flash)
}

/// Checks the new program with its signature once more, because writing the slot does not require the key.
fn check_new(flash: &impl Flash, key: &[u8; 32]) -> Result<(), Refusal> {
    program::check(flash, Slot::New)?;
    verify::signature(&program::header_bytes(flash, Slot::New), key)
}

/// Copies the running program to `Previous`, and returns the event that follows. A program on trial is never kept. If a
/// program that hangs were in `Previous`, the next failure would leave a foot that always hangs.
fn keep(flash: &mut impl Flash, state: &State) -> Result<Event, FlashFailed> {
    if program::same(flash, Slot::New, Slot::Running) {
        // The request for the install has marked a confirmed program.
        return Ok(if is_marked(flash) { Event::Confirmed } else { Event::Started });
    }
    if state.trial.is_none() && is_whole(flash) {
        // The record of the running program's confirmation may be weak. The previous program is overwritten now, so from
        // here on each start must come to the same decision.
        mark(flash)?;
        program::copy(flash, Slot::Running, Slot::Previous)?;
    }
    Ok(Event::Kept)
}

/// Copies the new program to `Running`.
fn replace(flash: &mut impl Flash) -> Result<(), Refusal> {
    program::copy(flash, Slot::New, Slot::Running).map_err(|FlashFailed| Refusal::FlashFailed)
}

/// Download of a program into [`Slot::New`], which must be cleared. The header is checked as soon as it is complete,
/// and written last.
#[derive(Debug)]
pub struct Download {
    header: [u8; HEADER],
    decoded: Option<Header>,
    /// Number of bytes received.
    received: u32,
    /// Bytes of an incomplete word.
    word: [u8; 4],
}

impl Default for Download {
    fn default() -> Self {
        Self { header: [0xFF; HEADER], decoded: None, received: 0, word: [0xFF; 4] }
    }
}

impl Download {
    /// Takes the next bytes.
    ///
    /// # Errors
    /// The reason why the program is refused.
    pub fn append(
        &mut self,
        bytes: &[u8],
        flash: &mut impl Flash,
        accept: impl Fn(&Header, &[u8; HEADER]) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        for &byte in bytes {
            if let Some(to) = self.header.get_mut(self.received as usize) {
                *to = byte;
                self.received += 1;
                if self.received as usize == HEADER {
                    let header = Header::decode(&self.header)?;
                    accept(&header, &self.header)?;
                    self.decoded = Some(header);
                }
                continue;
            }
            let whole = self.decoded.map_or(0, |header| header.length) + HEADER as u32;
            if self.received >= whole {
                return Err(Refusal::WrongLength);
            }
            if let Some(to) = self.word.get_mut(self.received as usize % 4) {
                *to = byte;
            }
            self.received += 1;
            if self.received.is_multiple_of(4) {
                let at = Slot::New.start() + self.received - 4;
                let word = u32::from_le_bytes(self.word);
                if word != u32::MAX && flash.program(at, word).is_err() {
                    return Err(Refusal::FlashFailed);
                }
            }
        }
        Ok(())
    }

    /// Ends the download: checks length and hash, and writes the header.
    ///
    /// # Errors
    /// The reason why the program is refused.
    pub fn end(&mut self, flash: &mut impl Flash) -> Result<(), Refusal> {
        let header = self.decoded.ok_or(Refusal::WrongLength)?;
        if self.received != HEADER as u32 + header.length {
            return Err(Refusal::WrongLength);
        }
        for (at, bytes) in (Slot::New.start()..).step_by(4).zip(self.header.as_chunks::<4>().0) {
            let word = u32::from_le_bytes(*bytes);
            if word != u32::MAX && flash.program(at, word).is_err() {
                return Err(Refusal::FlashFailed);
            }
        }
        program::check(flash, Slot::New).map(|_| ())
    }
}
