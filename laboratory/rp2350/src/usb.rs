//! The USB controller of the chip, and the computer at its socket: it enumerates a serial port, opens it, reads and sends.
//! The emulator has the controller's registers, but no bus.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

// Registers (RP2350 data sheet, 12.7.5).
const MAIN_CTRL: u32 = 0x40;
const SOF_RD: u32 = 0x48;
const SIE_CTRL: u32 = 0x4C;
const SIE_STATUS: u32 = 0x50;
const BUFF_STATUS: u32 = 0x58;
const INTR: u32 = 0x8C;
const INTE: u32 = 0x90;
const INTS: u32 = 0x98;

const CONTROLLER_EN: u32 = 1;
/// The pads are isolated from the controller, as after a reset.
const PHY_ISO: u32 = 1 << 2;
const PULLUP_EN: u32 = 1 << 16;

// Bits of the status, and of the interrupts.
const CONNECTED: u32 = 1 << 16;
const SETUP_REC: u32 = 1 << 17;
const STATUS_BUS_RESET: u32 = 1 << 19;
const INT_BUFF_STATUS: u32 = 1 << 4;
const INT_BUS_RESET: u32 = 1 << 12;
const INT_SETUP_REQ: u32 = 1 << 16;
const INT_DEV_SOF: u32 = 1 << 17;

// Bits of a buffer control word, and the address of the first word.
const LENGTH: u32 = 0x3FF;
const AVAILABLE: u32 = 1 << 10;
const STALL: u32 = 1 << 11;
const FULL: u32 = 1 << 15;
const BUFFER_CONTROLS: u32 = 0x80;
const CONTROL_BUFFER: usize = 0x100;

/// Cycles in a microsecond.
const US: u64 = 150;
/// A host waits for a plug to settle, resets the bus, and waits again before its first request.
const SETTLE: u64 = 10_000 * US;
const FRAME: u64 = 1_000 * US;
const REQUEST: u64 = 200 * US;
/// A packet of 64 bytes with its token and handshake, at 12 Mbit/s.
const PACKET: u64 = 55 * US;

const DEVICE: u16 = 1 << 8;
const CONFIGURATION: u16 = 2 << 8;
const STRING: u16 = 3 << 8;
const US_ENGLISH: u16 = 0x0409;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Reset,
    ResetEnds,
    Recovered,
    Frame,
    Setup,
    Token { endpoint: u32, is_out: bool },
}

/// Request of the host.
#[derive(Debug)]
struct Request {
    setup: [u8; 8],
    data: Vec<u8>,
    answer: Vec<u8>,
}

impl Request {
    fn new(kind: u8, request: u8, value: u16, index: u16, length: u16) -> Self {
        let [v0, v1] = value.to_le_bytes();
        let [i0, i1] = index.to_le_bytes();
        let [l0, l1] = length.to_le_bytes();
        let setup = [kind, request, v0, v1, i0, i1, l0, l1];
        Self { setup, data: Vec::new(), answer: Vec::new() }
    }

    fn descriptor(descriptor: u16, index: u16, length: u16) -> Self {
        Self::new(0x80, 6, descriptor, index, length)
    }

    const fn is_read(&self) -> bool {
        self.setup[0] & 0x80 != 0
    }
}

/// The controller, and the computer.
pub struct Usb {
    registers: [u32; 64],
    memory: Vec<u8>,
    sof: bool,
    events: BinaryHeap<Reverse<(u64, Event)>>,
    request: Option<Request>,
    /// Number of requests made.
    made: usize,
    endpoints: [Option<u32>; 2],
    unsent: VecDeque<u8>,
    /// Descriptors of the device, of its configuration, and its texts: manufacturer, product, serial number.
    pub device: Vec<u8>,
    configuration: Vec<u8>,
    pub texts: Vec<String>,
    /// Bytes that the board has sent.
    pub received: Vec<u8>,
}

impl Default for Usb {
    fn default() -> Self {
        let mut registers = [0; 64];
        registers[(MAIN_CTRL / 4) as usize] = PHY_ISO;
        Self {
            registers,
            memory: vec![0; 4096],
            sof: false,
            events: BinaryHeap::new(),
            request: None,
            made: 0,
            endpoints: [None; 2],
            unsent: VecDeque::new(),
            device: Vec::new(),
            configuration: Vec::new(),
            texts: Vec::new(),
            received: Vec::new(),
        }
    }
}

impl Usb {
    fn register(&mut self, offset: u32) -> &mut u32 {
        &mut self.registers[(offset / 4) as usize % 64]
    }

    fn raw(&self) -> u32 {
        let status = self.registers[(SIE_STATUS / 4) as usize];
        let set = |is_set: bool, bit| if is_set { bit } else { 0 };
        set(self.registers[(BUFF_STATUS / 4) as usize] != 0, INT_BUFF_STATUS)
            | set(status & STATUS_BUS_RESET != 0, INT_BUS_RESET)
            | set(status & SETUP_REC != 0, INT_SETUP_REQ)
            | set(self.sof, INT_DEV_SOF)
    }

    /// Level of the interrupt.
    pub fn is_pending(&self) -> bool {
        self.raw() & self.registers[(INTE / 4) as usize] != 0
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            INTR => self.raw(),
            INTS => self.raw() & *self.register(INTE),
            SOF_RD => {
                self.sof = false;
                *self.register(SOF_RD)
            }
            _ => *self.register(offset),
        }
    }

    /// Writes a register at a time in cycles. Bits of the status are cleared by ones.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        match offset {
            SIE_STATUS | BUFF_STATUS => *self.register(offset) &= !value,
            INTR | INTS | SOF_RD => {}
            _ => {
                let was_attached = self.is_attached();
                *self.register(offset) = value;
                if self.is_attached() && !was_attached {
                    self.at(now + SETTLE, Event::Reset);
                }
            }
        }
    }

    fn is_attached(&mut self) -> bool {
        *self.register(SIE_CTRL) & PULLUP_EN != 0
            && *self.register(MAIN_CTRL) & (CONTROLLER_EN | PHY_ISO) == CONTROLLER_EN
    }

    fn at(&mut self, time: u64, event: Event) {
        self.events.push(Reverse((time, event)));
    }

    /// Reads the memory of the controller.
    pub fn load(&self, at: u32, size: usize) -> u32 {
        let mut bytes = [0; 4];
        bytes[..size].copy_from_slice(&self.memory[at as usize..at as usize + size]);
        u32::from_le_bytes(bytes)
    }

    /// Writes the memory of the controller.
    pub fn store(&mut self, at: u32, size: usize, value: u32, now: u64) {
        self.memory[at as usize..at as usize + size].copy_from_slice(&value.to_le_bytes()[..size]);
        let (word, last) = (at & !3, at + size as u32);
        if !(BUFFER_CONTROLS..2 * BUFFER_CONTROLS).contains(&word) || last > 2 * BUFFER_CONTROLS {
            return;
        }
        let (endpoint, is_out) = ((word - BUFFER_CONTROLS) / 8, word & 4 != 0);
        let control = self.load(word, 4);
        if control & AVAILABLE != 0 {
            self.at(now + PACKET, Event::Token { endpoint, is_out });
        } else if control & STALL != 0 && endpoint == 0 && !is_out && self.request.is_some() {
            self.finish(now);
        }
    }

    /// Sends bytes to the board.
    pub fn send(&mut self, bytes: &[u8], now: u64) {
        self.unsent.extend(bytes);
        self.poll(now);
    }

    /// Returns whether the port is open.
    pub const fn is_open(&self) -> bool {
        self.request.is_none() && self.made > REQUESTS
    }

    fn poll(&mut self, now: u64) {
        for (endpoint, is_out) in [(self.endpoints[0], false), (self.endpoints[1], true)] {
            if let Some(endpoint) = endpoint {
                self.at(now + PACKET, Event::Token { endpoint, is_out });
            }
        }
    }

    /// Performs the actions that are due.
    pub fn advance(&mut self, now: u64) {
        while let Some(Reverse((time, event))) =
            self.events.peek().copied().filter(|Reverse((time, _))| *time <= now)
        {
            self.events.pop();
            match event {
                Event::Reset => {
                    *self.register(SIE_STATUS) |= STATUS_BUS_RESET;
                    self.at(time + SETTLE, Event::ResetEnds);
                }
                Event::ResetEnds => {
                    *self.register(SIE_STATUS) |= CONNECTED;
                    self.at(time + FRAME, Event::Frame);
                    self.at(time + SETTLE, Event::Recovered);
                }
                Event::Recovered => self.ask(time),
                Event::Frame => {
                    let number = self.register(SOF_RD);
                    *number = (*number + 1) & 0x7FF;
                    self.sof = true;
                    self.at(time + FRAME, Event::Frame);
                }
                Event::Setup => {
                    let setup = self.request.as_ref().map_or([0; 8], |request| request.setup);
                    self.memory[..8].copy_from_slice(&setup);
                    *self.register(SIE_STATUS) |= SETUP_REC;
                }
                Event::Token { endpoint, is_out } => self.transfer(endpoint, is_out, time),
            }
        }
    }

    /// Makes the next request.
    fn ask(&mut self, now: u64) {
        let text = |index: u8| Request::descriptor(STRING | u16::from(index), US_ENGLISH, 255);
        let request = match self.made {
            0 => Request::descriptor(DEVICE, 0, 18),
            1 => Request::new(0, 5, 1, 0, 0),
            2 => Request::descriptor(CONFIGURATION, 0, 9),
            3 => {
                let length = u16::from_le_bytes([self.configuration[2], self.configuration[3]]);
                Request::descriptor(CONFIGURATION, 0, length)
            }
            number @ 4..=6 => text(self.device[number + 10]),
            7 => Request::new(0, 9, 1, 0, 0),
            8 => {
                let request = Request::new(0x21, 0x20, 0, 0, 7);
                Request {
                    data: [115_200_u32.to_le_bytes().as_slice(), &[0, 0, 8]].concat(),
                    ..request
                }
            }
            // DTR and RTS.
            REQUESTS => Request::new(0x21, 0x22, 3, 0, 0),
            _ => {
                self.made = REQUESTS + 1;
                return self.poll(now);
            }
        };
        self.request = Some(request);
        self.at(now + REQUEST, Event::Setup);
    }

    /// Takes the answer to a request, and makes the next one.
    fn finish(&mut self, now: u64) {
        let Some(Request { answer, .. }) = self.request.take() else { return };
        match self.made {
            0 => self.device = answer,
            2 | 3 => self.configuration = answer,
            4..=6 => {
                let units = answer[2..].as_chunks().0.iter().map(|unit| u16::from_le_bytes(*unit));
                let text: Vec<u16> = units.collect();
                self.texts.push(String::from_utf16_lossy(&text));
            }
            7 => self.endpoints = bulk_endpoints(&self.configuration),
            _ => {}
        }
        self.made += 1;
        self.ask(now);
    }

    fn transfer(&mut self, endpoint: u32, is_out: bool, now: u64) {
        let place = BUFFER_CONTROLS + 8 * endpoint + if is_out { 4 } else { 0 };
        let control = self.load(place, 4);
        if control & AVAILABLE == 0 {
            return;
        }
        let size = (control & LENGTH) as usize;
        let buffer = match endpoint {
            0 => CONTROL_BUFFER,
            _ => self.load(8 * endpoint + if is_out { 4 } else { 0 }, 4) as usize & 0xFFC0,
        };
        let data: Vec<u8> = if !is_out {
            self.memory[buffer..buffer + size].to_vec()
        } else if endpoint == 0 {
            self.request.as_ref().map_or_else(Vec::new, |request| request.data.clone())
        } else if Some(endpoint) == self.endpoints[1] && !self.unsent.is_empty() {
            let length = size.min(self.unsent.len());
            self.unsent.drain(..length).collect()
        } else {
            return;
        };
        if Some(endpoint) == self.endpoints[0] && !is_out {
            self.received.extend(&data);
        } else if endpoint != 0 && !is_out {
            // Notifications of the port.
            return;
        }
        if is_out {
            self.memory[buffer..buffer + data.len()].copy_from_slice(&data);
        }
        let left = control & !(AVAILABLE | FULL | LENGTH);
        let control = left | data.len() as u32 | if is_out { FULL } else { 0 };
        self.memory[place as usize..place as usize + 4].copy_from_slice(&control.to_le_bytes());
        *self.register(BUFF_STATUS) |= 1 << (2 * endpoint + u32::from(is_out));
        if endpoint == 0 {
            self.go_on(is_out, &data, now);
        }
    }

    /// A packet of the control endpoint has passed. The last of a request goes against the direction of its data.
    fn go_on(&mut self, is_out: bool, data: &[u8], now: u64) {
        let Some(request) = &mut self.request else { return };
        if is_out == request.is_read() {
            self.finish(now);
        } else if !is_out {
            request.answer.extend(data);
        }
    }
}

/// Number of the request that opens the port, the last one.
const REQUESTS: usize = 9;

/// Numbers of the bulk endpoints, in and out, of the serial port's data.
fn bulk_endpoints(configuration: &[u8]) -> [Option<u32>; 2] {
    let mut found = [None; 2];
    let mut rest = configuration;
    while let [length, kind, address, attributes, ..] = *rest {
        if kind == 5 && attributes & 3 == 2 {
            found[usize::from(address & 0x80 == 0)] = Some(u32::from(address & 0xF));
        }
        rest = &rest[usize::from(length.max(1)).min(rest.len())..];
    }
    found
}
