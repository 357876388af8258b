//! The objects of a foot in its bootloader, with the program control of CiA 302-3.

use canopen_rs::nmt::NmtState;
use heapless::Vec;
use wire::AbortCode;
use wire::dictionary::{Address, PRODUCT_CODE, REVISION, VENDOR_ID, index};
use wire::domain::Domains;
use wire::sdo::{Objects, WriteOutcome};
use wire::value::Value;

use crate::DEVICE_NAME;
use crate::flash::{Flash, Slot};
use crate::image::{BROKEN_OFF, Board, HEADER, Header, Refusal, identification};
use crate::journal::{Progress, State};
use crate::update::{Download, ProgramState};
use crate::{program, verify};

/// Period of the heartbeat, ms.
pub const HEARTBEAT_MS: u16 = 500;

/// Segments of a sub-block: the maximum of the protocol.
const BLOCK: u8 = 127;

/// Bytes of a sub-block.
const BUFFER: usize = BLOCK as usize * 7;

/// Action of the bootloader after the response to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Restart, and thereby install a complete new program.
    Restart(Restart),
    /// Erase the remains of a refused download, so that the next one can begin.
    Clear,
}

/// Cause of a restart of the bootloader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restart {
    /// A master has asked for it.
    ByMaster,
    /// No master has controlled or sent a program for a minute.
    AfterSilence,
}

/// Progress of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Received {
    /// No download, or a refused one.
    Nothing,
    /// A transfer has begun. Objects are not read during a transfer, so a read in this state means that the transfer was
    /// broken off.
    Part,
    /// The slot for a new program holds a complete one.
    Program,
}

/// Objects of the bootloader.
pub struct Device<F> {
    /// The flash.
    pub flash: F,
    board: Board,
    serial: u32,
    key: &'static [u8; 32],
    /// Header of the running program; `None` if that program is not whole.
    running: Option<Header>,
    download: Download,
    buffer: Vec<u8, BUFFER>,
    /// Reason why the last program was refused.
    refusal: Option<Refusal>,
    /// Progress of the last download.
    progress: Received,
    action: Option<Action>,
    /// Whether a master has controlled or sent a program since [`Self::take_use`].
    is_used: bool,
}

impl<F: Flash> Device<F> {
    /// Creates the objects of a board with a serial number, for programs signed with `key`.
    pub fn new(flash: F, board: Board, serial: u32, key: &'static [u8; 32]) -> Self {
        let refusal = State::read(&flash).refusal;
        Self {
            flash,
            board,
            serial,
            key,
            running: None,
            download: Download::default(),
            buffer: Vec::new(),
            refusal,
            progress: Received::Nothing,
            action: None,
            is_used: false,
        }
    }

    /// Finds the running program. Called once, because hashing takes longer than masters wait for a response. A program
    /// that has just run is taken to be whole.
    pub fn find_running(&mut self, program: ProgramState) {
        self.running = match program {
            ProgramState::CanRun => program::header(&self.flash, Slot::Running),
            ProgramState::Missing(_) | ProgramState::Unsettled => {
                program::check(&self.flash, Slot::Running)
            }
        }
        .ok();
    }

    /// Returns whether a master has controlled or sent a program since the last call.
    pub const fn take_use(&mut self) -> bool {
        core::mem::replace(&mut self.is_used, false)
    }

    /// Takes the action to perform after the response.
    pub const fn take_action(&mut self) -> Option<Action> {
        self.action.take()
    }

    /// Erases the slot for a new program, unless it is already erased.
    pub fn clear(&mut self) {
        if self.progress == Received::Program {
            self.progress = Received::Nothing;
        }
        if !program::is_blank(&self.flash, Slot::New)
            && program::clear(&mut self.flash, Slot::New).is_err()
        {
            self.refusal = Some(Refusal::FlashFailed);
        }
    }

    /// NMT state. Programs are downloaded in pre-operational state.
    #[must_use]
    pub const fn state(&self) -> NmtState {
        NmtState::PreOperational
    }

    fn control(&mut self, command: u8) -> Result<(), AbortCode> {
        match command {
            0 => {}
            1 | 2 => {
                if command == 1 && self.progress == Received::Program {
                    let mut state = State::read(&self.flash);
                    // The image of a confirmed program does not put that program on trial again.
                    let is_confirmed = state.progress == Progress::Settled
                        && program::same(&self.flash, Slot::New, Slot::Running);
                    if !is_confirmed {
                        state.install(&mut self.flash).map_err(|_| AbortCode::Hardware)?;
                    }
                }
                self.action = Some(Action::Restart(Restart::ByMaster));
            }
            3 => {
                (self.refusal, self.progress) = (None, Received::Nothing);
                self.clear();
                if self.refusal.is_some() {
                    return Err(AbortCode::Hardware);
                }
            }
            // The program itself confirms, or a master does while the program runs.
            0x80 => return Err(AbortCode::DeviceState),
            _ => return Err(AbortCode::InvalidValue),
        }
        Ok(())
    }

    /// Records the reason why no program can be started.
    pub const fn explain(&mut self, why: Refusal) {
        self.refusal = Some(why);
    }

    /// Records the reason why a program is refused. Returns the abort code.
    fn refuse(&mut self, why: Refusal) -> AbortCode {
        (self.refusal, self.progress) = (Some(why), Received::Nothing);
        self.action = Some(Action::Clear);
        match why {
            Refusal::FlashFailed => AbortCode::Hardware,
            Refusal::NotCleared => AbortCode::DeviceState,
            _ => AbortCode::CannotStore,
        }
    }
}

impl<F: Flash> Objects for Device<F> {
    fn read(&mut self, address: Address) -> Result<Value, AbortCode> {
        let is_array = matches!(
            address.index,
            index::PROGRAM_DATA..=index::PROGRAM_CONTROL | index::PROGRAM_ID..=index::FLASH_STATUS
        );
        Ok(match (address.index, address.subindex) {
            (index::DEVICE_TYPE, 0) => Value::U32(0),
            (index::ERROR_REGISTER, 0) => Value::U8(0),
            (index::DEVICE_NAME, 0) => Value::Text(DEVICE_NAME),
            (index::SOFTWARE_VERSION, 0) => Value::Text(env!("CARGO_PKG_VERSION")),
            (index::HEARTBEAT, 0) => Value::U16(HEARTBEAT_MS),
            (index::IDENTITY, 0) => Value::U8(4),
            (index::IDENTITY, 1) => Value::U32(VENDOR_ID),
            (index::IDENTITY, 2) => Value::U32(PRODUCT_CODE),
            (index::IDENTITY, 3) => Value::U32(REVISION),
            (index::IDENTITY, 4) => Value::U32(self.serial),
            (index::PROGRAM_ID, 0) => Value::U8(2),
            (_, 0) if is_array => Value::U8(1),
            (index::PROGRAM_DATA, 1) => return Err(AbortCode::WriteOnly),
            (index::PROGRAM_CONTROL, 1) => Value::U8(0),
            (index::PROGRAM_ID, 1) => {
                // Masters compare a new, checked program before it is started, so its identification is shown then.
                Value::U32(match self.progress {
                    Received::Program => identification(&self.flash, Slot::New),
                    Received::Nothing | Received::Part => {
                        self.running.map_or(0, |header| header.identification())
                    }
                })
            }
            (index::PROGRAM_ID, 2) => Value::U32(identification(&self.flash, Slot::Previous)),
            (index::FLASH_STATUS, 1) => Value::U32(match (self.refusal, self.progress) {
                (Some(why), _) => why.flash_status(),
                (None, Received::Part) => BROKEN_OFF,
                (None, Received::Nothing | Received::Program) => 0,
            }),
            (
                index::DEVICE_TYPE
                | index::ERROR_REGISTER
                | index::DEVICE_NAME
                | index::SOFTWARE_VERSION
                | index::HEARTBEAT
                | index::IDENTITY,
                _,
            ) => return Err(AbortCode::NoSubindex),
            _ if is_array => return Err(AbortCode::NoSubindex),
            _ => return Err(AbortCode::NoObject),
        })
    }

    fn writable_size(&mut self, address: Address) -> Result<usize, AbortCode> {
        match (address.index, address.subindex) {
            (index::PROGRAM_CONTROL, 1) => Ok(1),
            _ => self.read(address).and(Err(AbortCode::ReadOnly)),
        }
    }

    fn write(&mut self, _: Address, bytes: &[u8]) -> Result<WriteOutcome, AbortCode> {
        let command = bytes.first().copied().ok_or(AbortCode::TooShort)?;
        self.control(command)?;
        self.is_used = true;
        Ok(WriteOutcome::Done)
    }
}

impl<F: Flash> Domains for Device<F> {
    const BLOCK: u8 = BLOCK;

    fn is_domain(&self, address: Address) -> bool {
        (address.index, address.subindex) == (index::PROGRAM_DATA, 1)
    }

    fn begin(&mut self, _: Address, size: Option<u32>) -> Result<(), AbortCode> {
        self.buffer.clear();
        self.download = Download::default();
        (self.refusal, self.progress) = (None, Received::Nothing);
        let longest = HEADER as u32 + crate::image::LONGEST;
        if size.is_some_and(|size| size > longest) {
            return Err(self.refuse(Refusal::WrongLength));
        }
        if program::is_blank(&self.flash, Slot::New) {
            (self.is_used, self.progress) = (true, Received::Part);
            Ok(())
        } else {
            Err(self.refuse(Refusal::NotCleared))
        }
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), AbortCode> {
        self.is_used = true;
        self.buffer.extend_from_slice(bytes).map_err(|_| AbortCode::Hardware)
    }

    fn flush(&mut self) -> Result<(), AbortCode> {
        let (board, key, running) = (self.board, self.key, self.running);
        let accept = |header: &Header, bytes: &[u8; HEADER]| {
            header.check(board, running.as_ref())?;
            verify::signature(bytes, key)
        };
        let taken = self.download.append(&self.buffer, &mut self.flash, accept);
        self.buffer.clear();
        taken.map_err(|why| self.refuse(why))
    }

    fn end(&mut self) -> Result<(), AbortCode> {
        match self.download.end(&mut self.flash) {
            Ok(()) => {
                self.progress = Received::Program;
                Ok(())
            }
            Err(why) => Err(self.refuse(why)),
        }
    }
}
