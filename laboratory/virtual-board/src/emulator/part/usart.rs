//! Serial line, both directions, 8 bits without parity.

use std::collections::VecDeque;

use super::unknown;
use crate::emulator::time::{NEVER, cycle};

// Offsets of the registers (RM0090, 30.6).
const SR: u32 = 0x00;
const DR: u32 = 0x04;
const BRR: u32 = 0x08;
const CR1: u32 = 0x0C;
const CR2: u32 = 0x10;
const CR3: u32 = 0x14;
const GTPR: u32 = 0x18;

// Bits of SR.
const FE: u32 = 1 << 1;
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;

// Bits of CR1.
const UE: u32 = 1 << 13;
const TE: u32 = 1 << 3;
const RE: u32 = 1 << 2;

/// A byte on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedByte {
    /// Time of the end of its stop bit, in units of [`time`](crate::emulator::time).
    pub time: u64,
    /// The byte.
    pub byte: u8,
}

/// A fault of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineFault {
    /// No fault.
    #[default]
    None,
    /// Open line: sent bytes are lost, and the receiver sees an idle line.
    Open,
    /// The receiver's line is held low, as by an unpowered sender: one byte without a stop bit, then no further
    /// edge. Sent bytes are lost.
    Break,
}

/// A byte being received.
#[derive(Clone, Copy, Debug)]
struct Incoming {
    /// Time of the end of its stop bit, present or not.
    time: u64,
    byte: u8,
    /// Whether it has a stop bit.
    stopped: bool,
}

/// The registers and the line. `default` is all zeros; the state after reset is [`new`](Self::new).
#[derive(Clone, Debug, Default)]
pub struct Usart {
    status: u32,
    data: u8,
    divider: u32,
    control: [u32; 3],
    guard: u32,
    waiting: Option<u8>,
    shifting: Option<u8>,
    done_at: u64,
    status_read: bool,
    /// Whether the status was read with TC set: the next write of data clears TC, which no other write does
    /// (RM0090, 30.6.1).
    complete_read: bool,
    idle_at: u64,
    /// Sent bytes that have not been taken.
    pub sent: Vec<TimedByte>,
    /// Bytes being received, with their times.
    incoming: VecDeque<Incoming>,
    fault: LineFault,
}

impl Usart {
    /// Creates the state after power-on.
    #[must_use]
    pub fn new() -> Self {
        Self { status: TC | TXE, done_at: NEVER, idle_at: NEVER, ..Self::default() }
    }

    /// Resets the registers; bytes on the line stay.
    pub fn reset(&mut self) {
        *self = Self {
            sent: core::mem::take(&mut self.sent),
            incoming: core::mem::take(&mut self.incoming),
            fault: self.fault,
            ..Self::new()
        };
    }

    /// Baud rate; 0 if not configured.
    #[must_use]
    pub fn rate(&self, pclk: u32) -> u32 {
        let divider = match self.control[0] & 1 << 15 {
            0 => self.divider,
            _ => (self.divider & 0xFFF0) >> 1 | self.divider & 7,
        };
        pclk.checked_div(divider).unwrap_or(0)
    }

    fn frame(&self, pclk: u32) -> u64 {
        let stop = if self.control[1] >> 12 & 3 == 2 { 2 } else { 1 };
        match self.rate(pclk) {
            0 => NEVER,
            rate => (9 + stop) * cycle(rate),
        }
    }

    /// Puts bytes on the line, starting no earlier than `time`.
    pub fn push(&mut self, bytes: &[u8], time: u64, pclk: u32) {
        if self.fault != LineFault::None {
            return;
        }
        let frame = match self.frame(pclk) {
            // Default while no rate is configured: 115 200 baud.
            NEVER => 10 * cycle(115_200),
            frame => frame,
        };
        let last = self.incoming.back();
        let mut at = last.map_or(time, |last| last.time.max(time));
        for &byte in bytes {
            at += frame;
            self.incoming.push_back(Incoming { time: at, byte, stopped: true });
        }
    }

    /// Number of bytes being received.
    #[must_use]
    pub fn incoming(&self) -> usize {
        self.incoming.len()
    }

    /// Sets or clears a fault of the line. Bytes being received are lost.
    pub fn set_fault(&mut self, fault: LineFault, now: u64, pclk: u32) {
        if fault == self.fault {
            return;
        }
        self.fault = fault;
        self.incoming.clear();
        let frame = self.frame(pclk);
        if fault == LineFault::Break && frame != NEVER {
            self.incoming.push_back(Incoming { time: now + frame, byte: 0, stopped: false });
        }
    }

    /// Time of the next event on the line.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        let received = self.incoming.front().map_or(NEVER, |byte| byte.time);
        received.min(self.done_at).min(self.idle_at)
    }

    /// Advances to `now`.
    pub fn advance(&mut self, now: u64, pclk: u32) {
        if self.done_at <= now {
            let time = self.done_at;
            self.done_at = NEVER;
            if let Some(byte) = self.shifting.take()
                && self.fault == LineFault::None
            {
                self.sent.push(TimedByte { time, byte });
            }
            self.begin(time, pclk);
            if self.shifting.is_none() {
                self.status |= TC;
            }
        }
        while let Some(&Incoming { time, byte, stopped }) = self.incoming.front()
            && time <= now
        {
            self.incoming.pop_front();
            if self.control[0] & (UE | RE) != UE | RE {
                continue;
            }
            if self.status & RXNE != 0 {
                self.status |= ORE;
            } else {
                self.data = byte;
                self.status |= RXNE | if stopped { 0 } else { FE };
            }
            let frame = self.frame(pclk);
            let next = self.incoming.front();
            let follows = next.is_some_and(|next| next.time <= time + frame);
            self.idle_at = if follows || !stopped { NEVER } else { time + frame };
            return;
        }
        if self.idle_at <= now {
            self.idle_at = NEVER;
            self.status |= IDLE;
        }
    }

    fn begin(&mut self, now: u64, pclk: u32) {
        if self.shifting.is_some() || self.control[0] & (UE | TE) != UE | TE {
            return;
        }
        if let Some(byte) = self.waiting.take() {
            self.shifting = Some(byte);
            self.done_at = now + self.frame(pclk);
            self.status |= TXE;
        }
    }

    const fn is_sending(&self) -> bool {
        self.waiting.is_some() || self.shifting.is_some()
    }

    /// Returns whether DMA is to write a byte.
    #[must_use]
    pub const fn wants_byte(&self) -> bool {
        self.control[2] & 1 << 7 != 0
            && self.control[0] & (UE | TE) == UE | TE
            && self.status & TXE != 0
    }

    /// Returns whether DMA is to read a byte.
    #[must_use]
    pub const fn has_byte(&self) -> bool {
        self.control[2] & 1 << 6 != 0 && self.status & RXNE != 0
    }

    /// Returns whether the interrupt is requested.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        // TXEIE, TCIE, RXNEIE and IDLEIE have the bit positions of their flags; an overrun interrupts with RXNEIE.
        self.status & self.control[0] & 0xF0 != 0
            || self.status & ORE != 0 && self.control[0] & RXNE != 0
            || self.status & (FE | ORE | 4) != 0 && self.control[2] & 1 != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            SR => {
                self.status_read = true;
                self.complete_read |= self.status & TC != 0;
                self.status
            }
            DR => {
                self.status &= !RXNE;
                if core::mem::take(&mut self.status_read) {
                    self.status &= !(ORE | IDLE | FE | 5);
                }
                u32::from(self.data)
            }
            BRR => self.divider,
            CR1 => self.control[0],
            CR2 => self.control[1],
            CR3 => self.control[2],
            GTPR => self.guard,
            _ => return unknown("USART", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, pclk: u32) -> Result<(), String> {
        match offset {
            SR => self.status &= value | !(RXNE | TC | 0x300),
            DR => {
                if self.waiting.is_some() {
                    return Err("a byte for the serial line overwrites one that waits".into());
                }
                self.waiting = Some(value as u8);
                self.status &= !TXE;
                if core::mem::take(&mut self.complete_read) {
                    self.status &= !TC;
                }
                self.begin(now, pclk);
            }
            // A byte that is being sent is cut (RM0090, 30.3.4).
            BRR if value & 0xFFFF != self.divider && self.is_sending() => {
                return Err("the rate of the serial line is changed while a byte is sent".into());
            }
            BRR => self.divider = value & 0xFFFF,
            CR1 => {
                if value & (1 << 12 | 1 << 10) != 0 {
                    return Err("9 bits and parity are not modelled".into());
                }
                self.control[0] = value;
                self.begin(now, pclk);
            }
            CR2 => self.control[1] = value,
            CR3 => self.control[2] = value,
            GTPR => self.guard = value,
            _ => return unknown("USART", offset),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERTZ: u32 = 80_000_000;

    fn sender() -> Usart {
        let mut usart = Usart::new();
        for (offset, value) in [(BRR, 80), (CR1, UE | TE)] {
            usart.write(offset, value, 0, HERTZ).expect("a register");
        }
        usart
    }

    #[test]
    fn write_of_data_clears_tc_after_a_read_of_the_status() {
        for is_read in [false, true] {
            let mut usart = sender();
            if is_read {
                usart.read(SR).expect("a register");
            }
            usart.write(DR, 0x55, 0, HERTZ).expect("a register");
            assert_eq!(usart.read(SR).expect("a register") & TC == 0, is_read);
        }
        let mut usart = sender();
        usart.write(SR, !TC, 0, HERTZ).expect("a register");
        usart.write(DR, 0x55, 0, HERTZ).expect("a register");
        assert_eq!(usart.read(SR).expect("a register") & TC, 0);
        usart.advance(usart.next_event(), HERTZ);
        assert_eq!(usart.read(SR).expect("a register") & TC, TC);
    }

    #[test]
    fn rate_does_not_change_while_a_byte_is_sent() {
        let mut usart = sender();
        usart.write(DR, 0x55, 0, HERTZ).expect("a register");
        assert!(usart.write(BRR, 40, 0, HERTZ).is_err());
        usart.advance(usart.next_event(), HERTZ);
        usart.write(BRR, 40, 0, HERTZ).expect("the line is idle");
    }
}
