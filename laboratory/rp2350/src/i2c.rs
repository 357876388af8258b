//! The I2C controller of the chip, a DW_apb_i2c, with the simulated sensor on its wires. The emulator has its registers,
//! but no wires.

use std::collections::VecDeque;

use lsm6dsox::register::{Register, WHO_AM_I};
use lsm6dsox::sim::{SharedPart, SimI2c};
use lsm6dsox::{Bus as _, I2c, Sa0};

/// Depth of each FIFO.
const DEPTH: usize = 16;

// Registers (RP2350 data sheet, 12.2.17).
const IC_TAR: u32 = 0x04;
const IC_DATA_CMD: u32 = 0x10;
const IC_FS_SCL_HCNT: u32 = 0x1C;
const IC_FS_SCL_LCNT: u32 = 0x20;
const IC_INTR_STAT: u32 = 0x2C;
const IC_INTR_MASK: u32 = 0x30;
const IC_RAW_INTR_STAT: u32 = 0x34;
const IC_RX_TL: u32 = 0x38;
const IC_TX_TL: u32 = 0x3C;
const IC_CLR_INTR: u32 = 0x40;
const IC_CLR_TX_ABRT: u32 = 0x54;
const IC_CLR_ACTIVITY: u32 = 0x5C;
const IC_CLR_STOP_DET: u32 = 0x60;
const IC_CLR_START_DET: u32 = 0x64;
const IC_ENABLE: u32 = 0x6C;
const IC_STATUS: u32 = 0x70;
const IC_TXFLR: u32 = 0x74;
const IC_RXFLR: u32 = 0x78;
const IC_TX_ABRT_SOURCE: u32 = 0x80;
const IC_ENABLE_STATUS: u32 = 0x9C;

// Interrupts.
const RX_FULL: u32 = 1 << 2;
const TX_EMPTY: u32 = 1 << 4;
const TX_ABRT: u32 = 1 << 6;
const ACTIVITY: u32 = 1 << 8;
const STOP_DET: u32 = 1 << 9;
const START_DET: u32 = 1 << 10;

// A command.
const READ: u32 = 1 << 8;
const STOP: u32 = 1 << 9;
const RESTART: u32 = 1 << 10;

/// Abort: the address was not acknowledged.
const ABRT_7B_ADDR_NOACK: u32 = 1;

/// Address of the sensor with a low SA0.
const SENSOR: u32 = 0x6A;

/// State of the wires.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Transfer {
    Idle,
    Writing { is_first: bool },
    Reading,
}

/// A read of the sensor.
#[derive(Clone, Copy, Debug)]
pub struct Read {
    /// Time of the first byte, ns.
    pub ns: u64,
    /// First register.
    pub first: u8,
    /// Number of bytes.
    pub length: usize,
}

/// The controller.
pub struct Controller {
    registers: [u32; 64],
    commands: VecDeque<u32>,
    received: VecDeque<u8>,
    events: u32,
    abort: u32,
    transfer: Transfer,
    /// Time at which the first command has been sent, cycles.
    until: Option<u64>,
    sensor: I2c<SimI2c>,
    /// Sensor's register of the next byte.
    address: u8,
    part: SharedPart,
    cycle_ns: f64,
    /// Reads of the sensor.
    pub reads: Vec<Read>,
}

impl Controller {
    /// A controller with the part on its wires, at a clock.
    pub fn new(part: SharedPart, clock_hz: f64) -> Self {
        Self {
            registers: [0; 64],
            commands: VecDeque::new(),
            received: VecDeque::new(),
            events: 0,
            abort: 0,
            transfer: Transfer::Idle,
            until: None,
            sensor: I2c::new(part.i2c(), Sa0::Low),
            address: 0,
            part,
            cycle_ns: 1.0e9 / clock_hz,
            reads: Vec::new(),
        }
    }

    fn register(&self, offset: u32) -> u32 {
        self.registers[(offset / 4) as usize % 64]
    }

    fn is_enabled(&self) -> bool {
        self.register(IC_ENABLE) & 1 == 1
    }

    fn raw(&self) -> u32 {
        let full = self.received.len() as u32 > self.register(IC_RX_TL);
        let empty = self.is_enabled() && self.commands.len() as u32 <= self.register(IC_TX_TL);
        self.events | if full { RX_FULL } else { 0 } | if empty { TX_EMPTY } else { 0 }
    }

    /// Level of the interrupt.
    pub fn is_pending(&self) -> bool {
        self.raw() & self.register(IC_INTR_MASK) != 0
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            IC_DATA_CMD => self.received.pop_front().unwrap_or(0).into(),
            IC_INTR_STAT => self.raw() & self.register(IC_INTR_MASK),
            IC_RAW_INTR_STAT => self.raw(),
            IC_CLR_INTR => self.clear(!0),
            IC_CLR_TX_ABRT => self.clear(TX_ABRT),
            IC_CLR_ACTIVITY => self.clear(ACTIVITY),
            IC_CLR_STOP_DET => self.clear(STOP_DET),
            IC_CLR_START_DET => self.clear(START_DET),
            IC_STATUS => {
                let is_active = u32::from(self.transfer != Transfer::Idle);
                is_active
                    | u32::from(self.commands.len() < DEPTH) << 1
                    | u32::from(self.commands.is_empty()) << 2
                    | u32::from(!self.received.is_empty()) << 3
                    | u32::from(self.received.len() == DEPTH) << 4
                    | is_active << 5
            }
            IC_TXFLR => self.commands.len() as u32,
            IC_RXFLR => self.received.len() as u32,
            IC_TX_ABRT_SOURCE => self.abort,
            IC_ENABLE_STATUS => self.register(IC_ENABLE) & 1,
            _ => self.register(offset),
        }
    }

    fn clear(&mut self, events: u32) -> u32 {
        if events & TX_ABRT != 0 {
            self.abort = 0;
        }
        self.events &= !events;
        0
    }

    /// Writes a register at a time in cycles.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        self.registers[(offset / 4) as usize % 64] = value;
        match offset {
            // After an abort the FIFO takes nothing until the abort is cleared.
            IC_DATA_CMD if self.events & TX_ABRT == 0 && self.is_enabled() => {
                assert!(self.commands.len() < DEPTH, "the FIFO of commands overflows");
                self.commands.push_back(value);
                self.begin(now);
            }
            IC_ENABLE if value & 1 == 0 => {
                self.commands.clear();
                self.received.clear();
                self.transfer = Transfer::Idle;
                self.until = None;
                self.events = 0;
            }
            _ => {}
        }
    }

    /// Begins to send the first command.
    fn begin(&mut self, now: u64) {
        let (None, Some(command)) = (self.until, self.commands.front()) else { return };
        let is_read = command & READ != 0;
        let continues = match self.transfer {
            Transfer::Idle => false,
            Transfer::Writing { .. } => !is_read,
            Transfer::Reading => is_read,
        } && command & RESTART == 0;
        let bits = 9 + if continues { 0 } else { 10 } + u32::from(command & STOP != 0);
        // A period has both counts, and the cycles that the controller adds to each level (12.2.14.1).
        let period = self.register(IC_FS_SCL_HCNT) + self.register(IC_FS_SCL_LCNT) + 8;
        self.until = Some(now + u64::from(bits * period));
    }

    /// Completes the commands that have ended by now.
    pub fn advance(&mut self, now: u64) {
        while let Some(end) = self.until.filter(|end| *end <= now) {
            self.until = None;
            let Some(command) = self.commands.pop_front() else { return };
            self.complete(command, end);
            self.begin(end);
        }
    }

    fn ns(&self, cycles: u64) -> u64 {
        (cycles as f64 * self.cycle_ns) as u64
    }

    fn complete(&mut self, command: u32, end: u64) {
        self.part.advance_to(self.ns(end));
        let is_read = command & READ != 0;
        let continues = matches!(
            (self.transfer, is_read),
            (Transfer::Writing { .. }, false) | (Transfer::Reading, true)
        ) && command & RESTART == 0;
        if !continues {
            self.events |= START_DET | ACTIVITY;
            self.transfer =
                if is_read { Transfer::Reading } else { Transfer::Writing { is_first: true } };
            if is_read {
                self.reads.push(Read { ns: self.ns(end), first: self.address, length: 0 });
            }
        }
        let answered = self.register(IC_TAR) == SENSOR && self.exchange(command);
        if !answered {
            self.abort |= ABRT_7B_ADDR_NOACK;
            self.events |= TX_ABRT | STOP_DET;
            self.commands.clear();
            self.transfer = Transfer::Idle;
        } else if command & STOP != 0 {
            self.events |= STOP_DET;
            self.transfer = Transfer::Idle;
        }
    }

    /// Exchanges a byte with the sensor; returns whether the sensor acknowledges it.
    fn exchange(&mut self, command: u32) -> bool {
        match self.transfer {
            Transfer::Idle => false,
            Transfer::Writing { is_first: true } => {
                self.address = command as u8;
                self.transfer = Transfer::Writing { is_first: false };
                // An address alone is acknowledged as any other byte.
                self.sensor.read(&mut [WHO_AM_I.read_address(), 0]).is_ok()
            }
            Transfer::Writing { is_first: false } => {
                let written = self.sensor.write(self.address, command as u8).is_ok();
                self.follow();
                written
            }
            Transfer::Reading => {
                let mut frame = [self.address | Register::READ, 0];
                let read = self.sensor.read(&mut frame).is_ok();
                self.received.push_back(frame[1]);
                if let Some(read) = self.reads.last_mut() {
                    read.length += 1;
                }
                self.follow();
                read
            }
        }
    }

    const fn follow(&mut self) {
        self.address = (self.address + 1) & !Register::READ;
    }
}
