//! The registers, the transmit mailboxes, and the interrupt lines (RM0090, 32.9).

use super::{BusFault, BusFrame, Can, Sender};
use crate::emulator::part::unknown;
use crate::emulator::time::NEVER;

pub(super) const INRQ: u32 = 1;
pub(super) const SLEEP: u32 = 2;
pub(super) const TXFP: u32 = 4;
pub(super) const NART: u32 = 1 << 4;
pub(super) const ABOM: u32 = 1 << 6;
pub(super) const INAK: u32 = 1;
pub(super) const SLAK: u32 = 2;
pub(super) const ERRI: u32 = 4;
/// Of a mailbox, in the status of transmission.
const ABRQ: u32 = 0x80;
/// Bit timing after a reset.
pub(super) const RESET_TIMING: u32 = 0x0123_0000;
pub(super) const LOOPBACK: u32 = 1 << 30;
pub(super) const SILENT: u32 = 1 << 31;

/// A frame that waits for transmission.
#[derive(Clone, Debug, Default)]
pub(super) struct Mailbox {
    pub(super) registers: [u32; 4],
    pub(super) pending: bool,
    pub(super) order: u64,
}

impl Mailbox {
    pub(super) fn frame(&self) -> BusFrame {
        let [identifier, length, low, high] = self.registers;
        let mut data = [low.to_le_bytes(), high.to_le_bytes()].concat();
        data.truncate((length & 0xF) as usize);
        BusFrame { id: identifier >> 21, data }
    }
}

impl Can {
    /// Lines of the transmit, the two receive and the status interrupts.
    #[must_use]
    pub fn lines(&self) -> [bool; 4] {
        let fifo = |index: usize| {
            let shift = 3 * index;
            self.interrupts & 2 << shift != 0 && !self.fifo[index].is_empty()
                || self.interrupts & 4 << shift != 0 && self.fifo_flags[index] & 8 != 0
                || self.interrupts & 8 << shift != 0 && self.fifo_flags[index] & 0x10 != 0
        };
        [
            self.interrupts & 1 != 0 && self.transmit & 0x01_0101 != 0,
            fifo(0),
            fifo(1),
            self.interrupts & 1 << 15 != 0 && self.status & ERRI != 0,
        ]
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32, now: u64) -> Result<u32, String> {
        self.advance(now);
        Ok(match offset {
            0x00 => self.control & !(1 << 15),
            // The receive pin is recessive while no node sends.
            0x04 => self.status | 0xC00,
            0x08 => {
                let empty = (0..3)
                    .filter(|&index| !self.mailboxes[index].pending)
                    .fold(0, |word, index| word | 1 << (26 + index));
                let code = self
                    .mailboxes
                    .iter()
                    .position(|mailbox| !mailbox.pending)
                    .or_else(|| self.next_mailbox())
                    .unwrap_or(0) as u32;
                self.transmit | empty | code << 24
            }
            0x0C | 0x10 => {
                let index = (offset as usize - 0xC) / 4;
                self.fifo[index].len() as u32 | self.fifo_flags[index]
            }
            0x14 => self.interrupts,
            0x18 => {
                self.error_state()
                    | self.last_error << 4
                    | (self.transmit_errors & 0xFF) << 16
                    | (self.receive_errors & 0xFF) << 24
            }
            0x1C => self.timing,
            0x180..0x1B0 => {
                let at = offset as usize - 0x180;
                let mailbox = &self.mailboxes[at / 16];
                mailbox.registers[at % 16 / 4] | u32::from(mailbox.pending && at.is_multiple_of(16))
            }
            0x1B0..0x1D0 => {
                let at = offset as usize - 0x1B0;
                self.fifo[at / 16].front().map_or(0, |entry| entry[at % 16 / 4])
            }
            0x200 => self.filter_master,
            0x204 => self.filter_mode,
            0x20C => self.filter_scale,
            0x214 => self.filter_fifo,
            0x21C => self.filter_active,
            0x240..0x320 => {
                let at = offset as usize - 0x240;
                self.filters[at / 8][at % 8 / 4]
            }
            _ => return unknown("CAN", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or it is locked.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        self.advance(now);
        self.now = self.now.max(now);
        match offset {
            0x00 if value & 1 << 15 != 0 => self.reset(self.pclk, now),
            0x00 => self.set_control(value)?,
            0x04 => self.status &= !(value & 0x1C),
            0x08 => {
                for index in 0..3 {
                    let shift = 8 * index;
                    if value >> shift & 1 == 1 {
                        self.transmit &= !(0xF << shift);
                    }
                    if value >> shift & ABRQ != 0 && self.mailboxes[index].pending {
                        self.transmit |= ABRQ << shift;
                        // The frame on the bus is completed first.
                        let sending =
                            matches!(self.busy, Some((Sender::Mailbox(at), _)) if at == index);
                        if !sending && self.is_aborted(index) {
                            self.complete(index, false);
                        }
                    }
                }
            }
            0x0C | 0x10 => {
                let index = (offset as usize - 0xC) / 4;
                self.fifo_flags[index] &= !(value & 0x18);
                if value & 0x20 != 0 {
                    self.fifo[index].pop_front();
                    self.fifo_flags[index] &= !8;
                }
            }
            0x14 => self.interrupts = value,
            0x18 => self.last_error = value >> 4 & 7,
            0x1C if self.status & INAK == 0 => {
                return Err("the bit timing is set outside initialisation".into());
            }
            0x1C => self.timing = value,
            0x180..0x1B0 => {
                let at = offset as usize - 0x180;
                let order = self.order;
                let mailbox = &mut self.mailboxes[at / 16];
                if mailbox.pending {
                    return Err("a mailbox is written while its frame waits".into());
                }
                if at.is_multiple_of(16) && value & 0b110 != 0 {
                    return Err("29-bit identifiers and remote frames are not modelled".into());
                }
                mailbox.registers[at % 16 / 4] = value;
                if at.is_multiple_of(16) {
                    mailbox.registers[0] = value & !1;
                    if value & 1 != 0 {
                        mailbox.pending = true;
                        mailbox.order = order;
                        let id = mailbox.frame().id;
                        self.requested.push((now, id));
                        self.order += 1;
                        self.transmit &= !(0xF << (8 * (at / 16)));
                    }
                }
            }
            0x200 => self.filter_master = value & 0x3F01 | 0x2A1C_0000,
            0x204 | 0x20C if self.filter_master & 1 == 0 => {
                return Err("filters are set outside their initialisation".into());
            }
            0x204 => self.filter_mode = value,
            0x20C => self.filter_scale = value,
            0x214 => self.filter_fifo = value,
            0x21C => self.filter_active = value,
            0x240..0x320 => {
                let at = offset as usize - 0x240;
                self.filters[at / 8][at % 8 / 4] = value;
            }
            _ => return unknown("CAN", offset),
        }
        Ok(())
    }

    /// Enters initialisation mode, if requested.
    pub(super) const fn acknowledge(&mut self) {
        if self.control & INRQ == 0 {
            return;
        }
        self.status = self.status & !SLAK | INAK;
        self.joined_at = NEVER;
        if self.control & SLEEP == 0 {
            // Initialisation ends bus-off after a time; the model ends it at once.
            self.off = false;
        }
    }

    fn set_control(&mut self, value: u32) -> Result<(), String> {
        let old = core::mem::replace(&mut self.control, value & 0x1_00FF);
        if value & INRQ != 0 {
            // The frame on the bus is completed first, and a bus that is never idle delays this indefinitely.
            let is_held = self.busy.is_some() || self.is_shorted();
            if !(self.is_normal() && is_held) {
                self.acknowledge();
            }
        } else if value & SLEEP != 0 {
            self.status = self.status & !INAK | SLAK;
            self.joined_at = NEVER;
        } else if old & (INRQ | SLEEP) != 0 {
            if self.timing == RESET_TIMING {
                return Err("the bus is joined at the bit timing after a reset".into());
            }
            // Synchronises to eleven recessive bits.
            self.wait_for_idle(11);
        }
        Ok(())
    }

    pub(super) fn next_mailbox(&self) -> Option<usize> {
        (0..3).filter(|&index| self.mailboxes[index].pending).min_by_key(|&index| {
            let mailbox = &self.mailboxes[index];
            let rank = match self.control & TXFP {
                0 => u64::from(mailbox.frame().id),
                _ => mailbox.order,
            };
            (rank, index)
        })
    }

    /// Returns whether the program has withdrawn the frame of a mailbox, and the controller obeys.
    pub(super) fn is_aborted(&self, index: usize) -> bool {
        self.transmit >> (8 * index) & ABRQ != 0 && self.fault != BusFault::AbortIgnored
    }

    pub(super) fn complete(&mut self, index: usize, sent: bool) {
        self.mailboxes[index].pending = false;
        let shift = 8 * index;
        self.transmit &= !((ABRQ | 0xF) << shift);
        self.transmit |= (1 | u32::from(sent) << 1) << shift;
    }
}
