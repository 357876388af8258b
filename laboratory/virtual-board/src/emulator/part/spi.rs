//! Serial peripheral interface, as master of 8-bit frames.

use super::unknown;
use crate::emulator::time::{NEVER, cycle};

// Offsets of the registers (RM0090, 28.5).
const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;
const CRCPR: u32 = 0x10;
const RXCRCR: u32 = 0x14;
const TXCRCR: u32 = 0x18;
const I2SCFGR: u32 = 0x1C;
const I2SPR: u32 = 0x20;

// Bits of CR1.
const SPE: u32 = 1 << 6;
const MSTR: u32 = 1 << 2;
const DFF: u32 = 1 << 11;

// Bits of SR.
const RXNE: u32 = 1;
const TXE: u32 = 1 << 1;
const MODF: u32 = 1 << 5;
const OVR: u32 = 1 << 6;
const BSY: u32 = 1 << 7;

/// The registers. `default` is all zeros; the state after reset is [`new`](Self::new).
#[derive(Clone, Debug, Default)]
pub struct Spi {
    control: [u32; 2],
    status: u32,
    waiting: Option<u8>,
    shifting: Option<u8>,
    received: u8,
    done_at: u64,
    /// Whether the data register was read with an overrun pending.
    overrun_read: bool,
    /// Whether the clock of the bus is stopped, so that no frame ends.
    stopped: bool,
}

impl Spi {
    /// Creates the state after power-on.
    #[must_use]
    pub fn new() -> Self {
        Self { status: TXE, done_at: NEVER, ..Self::default() }
    }

    /// Resets the registers.
    pub fn reset(&mut self) {
        *self = Self { stopped: self.stopped, ..Self::new() };
    }

    /// Stops the clock, which no reset restarts, or restarts it.
    pub const fn set_stopped(&mut self, stopped: bool, now: u64, pclk: u32) {
        self.stopped = stopped;
        self.time_frame(now, pclk);
    }

    /// Time of the end of the frame on the bus.
    #[must_use]
    pub const fn next_event(&self) -> u64 {
        self.done_at
    }

    /// Clock frequency on the bus, Hz.
    #[must_use]
    pub const fn bit_rate(&self, pclk: u32) -> u32 {
        pclk >> ((self.control[0] >> 3 & 7) + 1)
    }

    /// Polarity and phase as modes 0 to 3.
    #[must_use]
    pub const fn mode(&self) -> u32 {
        (self.control[0] >> 1 & 1) << 1 | self.control[0] & 1
    }

    /// Takes the byte whose transmission ends now; `None` while the frame continues.
    pub const fn take_frame(&mut self, now: u64) -> Option<u8> {
        if now < self.done_at {
            return None;
        }
        self.done_at = NEVER;
        self.shifting.take()
    }

    /// Completes the frame with the received byte.
    pub const fn finish_frame(&mut self, byte: u8, now: u64, pclk: u32) {
        if self.status & RXNE != 0 {
            self.status |= OVR;
        } else {
            self.received = byte;
            self.status |= RXNE;
        }
        self.begin(now, pclk);
    }

    const fn begin(&mut self, now: u64, pclk: u32) {
        if self.shifting.is_some() || self.control[0] & SPE == 0 {
            return;
        }
        if let Some(byte) = self.waiting.take() {
            self.shifting = Some(byte);
            self.status |= TXE;
            self.time_frame(now, pclk);
        }
    }

    /// Starts the time of the frame on the bus, if any.
    const fn time_frame(&mut self, now: u64, pclk: u32) {
        self.done_at = if self.shifting.is_some() && !self.stopped {
            now + 8 * cycle(self.bit_rate(pclk))
        } else {
            NEVER
        };
    }

    /// Returns whether DMA is to write a byte.
    #[must_use]
    pub const fn wants_byte(&self) -> bool {
        self.control[0] & SPE != 0 && self.control[1] & 2 != 0 && self.status & TXE != 0
    }

    /// Returns whether DMA is to read a byte.
    #[must_use]
    pub const fn has_byte(&self) -> bool {
        self.control[1] & 1 != 0 && self.status & RXNE != 0
    }

    /// Returns whether the interrupt is requested.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        self.control[1] & 1 << 7 != 0 && self.status & TXE != 0
            || self.control[1] & 1 << 6 != 0 && self.status & RXNE != 0
            || self.control[1] & 1 << 5 != 0 && self.status & (OVR | MODF) != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            CR1 => self.control[0],
            CR2 => self.control[1],
            SR => {
                let status = self.status | if self.shifting.is_some() { BSY } else { 0 };
                if core::mem::take(&mut self.overrun_read) {
                    self.status &= !OVR;
                }
                status
            }
            DR => {
                self.status &= !RXNE;
                self.overrun_read = self.status & OVR != 0;
                u32::from(self.received)
            }
            CRCPR => 7,
            RXCRCR | TXCRCR | I2SCFGR => 0,
            I2SPR => 2,
            _ => return unknown("SPI", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, pclk: u32) -> Result<(), String> {
        match offset {
            CR1 => {
                if value & SPE != 0 && (value & MSTR == 0 || value & DFF != 0) {
                    return Err("SPI is a master of 8-bit frames only".into());
                }
                if value & SPE != 0 && value & 0xA080 != 0 {
                    return Err("SPI has no half duplex, no CRC and sends its top bit first".into());
                }
                if value & SPE == 0 && self.shifting.is_some() {
                    return Err("SPI is switched off in the middle of a frame".into());
                }
                self.control[0] = value;
                self.begin(now, pclk);
            }
            CR2 => self.control[1] = value,
            SR | CRCPR | I2SCFGR | I2SPR => {}
            DR => {
                if self.waiting.is_some() {
                    return Err("a byte for SPI overwrites one that waits".into());
                }
                self.waiting = Some(value as u8);
                self.status &= !TXE;
                self.begin(now, pclk);
            }
            _ => return unknown("SPI", offset),
        }
        Ok(())
    }
}
