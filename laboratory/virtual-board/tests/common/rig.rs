//! A board with a master on both of its lines: requests, answers and frames.

use estimator_core::Decision;
use lsm6dsox::sim::{Motion, Stimulus};
use virtual_board::emulator::board::{Board, BoardOptions, Injection};
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::part::usart::LineFault;
use wire::dictionary::{SIGNATURE_STORE, index};
use wire::uart::{Answer, ConfigGet, ConfigSet, Decoder, HealthMessage, Message, encode};
use wire::{Address, Emergency, Value, pdo};

use super::{MILLISECOND, boot_product, options};

pub const PRE_OPERATIONAL: u8 = 0x80;
pub const OPERATIONAL: u8 = 0x01;
pub const STOP: u8 = 0x02;
pub const RESET_NODE: u8 = 0x81;
pub const RESET_COMMUNICATION: u8 = 0x82;

/// SDO request with a command, and a value of up to four bytes.
pub fn sdo(command: u8, index: u16, subindex: u8, value: u32) -> [u8; 8] {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    [command, low, high, subindex, a, b, c, d]
}

/// A board with a record of all it has sent.
pub struct Rig {
    pub board: Board,
    decoder: Decoder,
    frames: Vec<(u64, BusFrame)>,
    pub messages: Vec<(u64, Message)>,
    /// Number of frames on the serial line that are not valid.
    pub damaged: usize,
}

impl Rig {
    pub fn new(elf: &[u8]) -> Self {
        Self::of(boot_product(elf))
    }

    /// A board at rest, with changed options.
    pub fn with(elf: &[u8], change: impl FnOnce(&mut BoardOptions)) -> Self {
        let mut options = options();
        change(&mut options);
        let at_rest = |_| Stimulus::REST;
        Self::of(Board::with_motion(elf, options, at_rest).expect("it fits the flash"))
    }

    /// A board moved by `motion`.
    pub fn moved(elf: &[u8], motion: impl Motion + 'static) -> Self {
        Self::of(Board::with_motion(elf, options(), motion).expect("it fits the flash"))
    }

    pub fn of(board: Board) -> Self {
        let (frames, messages) = (Vec::new(), Vec::new());
        Self { board, decoder: Decoder::new(), frames, messages, damaged: 0 }
    }

    pub fn run_us(&mut self, us: u64) {
        if let Err(failure) = self.board.run_for(us * MILLISECOND / 1000) {
            panic!("{failure}");
        }
        for sent in self.board.take_can() {
            self.frames.push((sent.time, sent.frame));
        }
        for sent in self.board.take_uart() {
            match self.decoder.push(sent.byte) {
                Some(Ok(frame)) => self.messages.push((sent.time, frame.message)),
                Some(Err(_)) => self.damaged += 1,
                None => {}
            }
        }
        self.board.take_can_requests();
    }

    pub fn run(&mut self, ms: u64) {
        for _ in 0..ms / 10 {
            self.run_us(10_000);
        }
        self.run_us(ms % 10 * 1000);
    }

    pub fn forget(&mut self) {
        self.frames.clear();
        self.messages.clear();
    }

    pub fn can(&mut self, id: u16, data: &[u8]) {
        self.board.push_can(BusFrame::new(id, data));
    }

    pub fn nmt(&mut self, command: u8) {
        self.can(0x000, &[command, 0x11]);
    }

    pub fn send(&mut self, message: &Message) {
        self.board.push_uart(encode(0, message).as_bytes());
    }

    pub fn uart_get(&mut self, index: u16, subindex: u8) {
        let address = Address::new(index, subindex);
        self.send(&Message::ConfigGet(ConfigGet { address }));
    }

    pub fn uart_set(&mut self, index: u16, subindex: u8, value: Value) {
        let (address, value) = (Address::new(index, subindex), value.into());
        self.send(&Message::ConfigSet(ConfigSet { address, value }));
    }

    pub fn sdo_write(&mut self, index: u16, subindex: u8, value: u32) {
        self.can(0x611, &sdo(0x22, index, subindex, value));
    }

    pub fn sdo_read(&mut self, index: u16, subindex: u8) {
        self.can(0x611, &sdo(0x40, index, subindex, 0));
    }

    /// Sends an SDO request. Returns its answer, if it arrives within `ms`.
    pub fn ask(&mut self, request: [u8; 8], ms: u64) -> Option<[u8; 8]> {
        self.forget();
        self.can(0x611, &request);
        (0..4 * ms).find_map(|_| {
            self.run_us(250);
            self.answers().first().copied()
        })
    }

    /// Writes a value of four bytes. Returns the answer.
    pub fn write(&mut self, index: u16, subindex: u8, value: u32) -> [u8; 8] {
        let answer = self.ask(sdo(0x23, index, subindex, value), 2_000);
        answer.expect("an answer")
    }

    /// Reads a value of up to four bytes.
    pub fn read(&mut self, index: u16, subindex: u8) -> u32 {
        let answer = self.ask(sdo(0x40, index, subindex, 0), 2_000);
        let [.., a, b, c, d] = answer.expect("an answer");
        u32::from_le_bytes([a, b, c, d])
    }

    /// Stores the settings. Returns the answer.
    pub fn stored(&mut self) -> [u8; 8] {
        self.write(index::STORE, 1, SIGNATURE_STORE)
    }

    pub fn pre_operational(&mut self) {
        self.nmt(PRE_OPERATIONAL);
        self.run(5);
    }

    pub fn operational(&mut self) {
        self.nmt(OPERATIONAL);
        self.run(5);
    }

    pub fn inject(&mut self, injection: Injection) {
        self.board.inject(injection);
    }

    /// Runs for `ms`. Returns the codes of emergency messages and the number of contacts.
    pub fn watch(&mut self, ms: u64) -> (Vec<u16>, usize) {
        self.forget();
        self.run(ms);
        (self.emergencies(), self.contacts())
    }

    pub fn store(&mut self) {
        self.sdo_write(index::STORE, 1, SIGNATURE_STORE);
    }

    /// Answers of the SDO server so far.
    pub fn answers(&self) -> Vec<[u8; 8]> {
        let answers = self.frames.iter().filter(|(_, frame)| frame.id == 0x591);
        let data = answers.map(|(_, frame)| frame.data.as_slice());
        data.filter_map(|data| data.try_into().ok()).collect()
    }

    pub fn uart_answers(&self, index: u16) -> Vec<Answer> {
        let answers = self.messages.iter().filter_map(|(_, sent)| match sent {
            Message::ConfigResponse(response) if response.address.index == index => {
                Some(response.answer)
            }
            _ => None,
        });
        answers.collect()
    }

    /// Codes of the faults in emergency messages.
    pub fn emergencies(&self) -> Vec<u16> {
        let codes = self.emergency_messages().into_iter().map(|sent| sent.code);
        codes.filter(|code| *code != 0).collect()
    }

    /// Emergency messages, including messages that report a fault cleared.
    pub fn emergency_messages(&self) -> Vec<Emergency> {
        let is_emergency = |id: u32| id & !0x7F == 0x080;
        let frames = self.frames.iter();
        let frames = frames.filter(|(_, frame)| is_emergency(frame.id));
        let data = frames.filter_map(|(_, frame)| frame.data.as_slice().try_into().ok());
        data.map(|data: [u8; 8]| Emergency::decode(&data)).collect()
    }

    /// Times of frames that say "stable", with their line: `c` for CAN, `u` for the serial line.
    pub fn stable(&self) -> Vec<(u64, char)> {
        let says = |probability: u16, status: pdo::Status| {
            status.decision() == Decision::Stable || status.is_valid() && probability >= 0x8000
        };
        let mut all = Vec::new();
        for (time, frame) in &self.frames {
            if frame.id & !0x7F == 0x180
                && let Ok(data) = <[u8; 8]>::try_from(frame.data.as_slice())
            {
                let contact = pdo::Contact::decode(&data);
                if says(contact.stable.0, contact.status) {
                    all.push((*time, 'c'));
                }
            }
        }
        for (time, message) in &self.messages {
            if let Message::Contact(contact) = message
                && says(contact.stable.0, contact.status)
            {
                all.push((*time, 'u'));
            }
        }
        all
    }

    pub fn contacts(&self) -> usize {
        self.count(0x191)
    }

    /// Number of frames with this identifier.
    pub fn count(&self, id: u32) -> usize {
        let frames = self.frames.iter().filter(|(_, frame)| frame.id == id);
        frames.count()
    }

    /// Last health message of the serial line.
    pub fn health(&self) -> Option<HealthMessage> {
        self.messages.iter().rev().find_map(|(_, sent)| match sent {
            Message::Health(health) => Some(*health),
            _ => None,
        })
    }

    pub fn resets(&self) -> Vec<ResetCause> {
        self.board.resets().iter().map(|(_, cause)| *cause).collect()
    }
}

/// A short disturbance of the serial line: low for three bits longer than a byte.
pub fn glitch(rig: &mut Rig) {
    rig.board.inject(Injection::Line(LineFault::Break));
    rig.run_us(30);
    rig.board.inject(Injection::Line(LineFault::None));
}
