//! The CAN controller bxCAN, and a bus with a second node (RM0090, 32). Registers and bits have the names of the manual.
//!
//! In the order of a frame: the program puts it into a mailbox ([`Can::write`]); mailboxes and other nodes compete for
//! the bus, and the frame ends ([`Can::advance`]); errors are counted; a frame of another node passes the filters, and the
//! program reads it from its FIFO ([`Can::read`]).

use std::collections::VecDeque;

use wire::{CanFrame, slcan};

use crate::emulator::part::unknown;
use crate::emulator::time::{NEVER, cycle};

/// The controller and its bus.
#[derive(Clone, Debug, Default)]
pub struct Can {
    mcr: u32,
    msr: u32,
    /// `TSR` without `CODE` and `TME`, which follow from the mailboxes.
    tsr: u32,
    /// `RF0R` and `RF1R` without `FMP`, which follows from the FIFO.
    rfr: [u32; 2],
    ier: u32,
    btr: u32,
    fmr: u32,
    fm1r: u32,
    fs1r: u32,
    ffa1r: u32,
    fa1r: u32,
    /// Filter banks, each with `FxR1` and `FxR2`.
    filters: [[u32; 2]; 28],
    mailboxes: [Mailbox; 3],
    /// Order of the next request among the requests of all mailboxes.
    order: u64,
    /// Received frames, each as `RIxR`, `RDTxR`, `RDLxR` and `RDHxR`.
    fifo: [VecDeque<[u32; 4]>; 2],
    /// `LEC`, `TEC` and `REC` of `ESR`.
    last_error: u32,
    transmit_errors: u32,
    receive_errors: u32,
    /// Whether the controller is off the bus.
    pub off: bool,
    /// Clock of the peripheral, Hz.
    pub(crate) pclk: u32,
    now: u64,
    /// Sender of the frame on the bus, and the time of its end.
    busy: Option<(Sender, u64)>,
    /// Time at which the bus was idle long enough to join, or to recover from bus-off.
    joined_at: u64,
    /// Fault of the bus.
    pub fault: BusFault,
    /// Frames that the controller has sent.
    pub sent: Vec<TimedFrame>,
    /// Time at which each frame was put into a mailbox, and its identifier; kept until taken.
    pub requested: Vec<(u64, u32)>,
    /// Frames of the other node with their earliest times.
    incoming: VecDeque<TimedFrame>,
    /// Frames that arrived while a FIFO was full.
    pub overruns: u64,
}

/// A fault of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusFault {
    /// No fault.
    #[default]
    None,
    /// No other node: frames are not acknowledged.
    NoAcknowledge,
    /// No other node, and the controller does not abort a frame.
    AbortIgnored,
    /// The lines are shorted: every transmitted bit reads back wrong, and the bus is never idle.
    Shorted,
    /// Another node sends frames of the highest priority without a pause.
    Saturated,
}

/// Sender of the frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sender {
    Mailbox(usize),
    Peer,
    /// The node that saturates the bus.
    Flood,
}

/// A frame of CAN 2.0: a data frame with an identifier of 11 bits, unless it says otherwise.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BusFrame {
    /// Identifier, of 11 or 29 bits.
    pub id: u32,
    /// Payload, up to eight bytes. A remote frame has its length, and sends none of its bytes.
    pub data: Vec<u8>,
    /// Whether the identifier has 29 bits.
    pub is_extended: bool,
    /// Whether the frame asks for data.
    pub is_remote: bool,
}

impl BusFrame {
    /// A data frame with at most eight bytes of the data.
    #[must_use]
    pub fn new(id: u16, data: &[u8]) -> Self {
        let data = data.iter().copied().take(8).collect();
        Self { id: u32::from(id), data, ..Self::default() }
    }

    /// The frame of a node of the workspace.
    #[must_use]
    pub fn of(frame: &CanFrame) -> Self {
        Self::new(frame.id(), frame.data())
    }

    /// Line for this frame as an slcan adapter sends it, with CR.
    #[must_use]
    pub fn line(&self) -> Vec<u8> {
        let frame = CanFrame::new(self.id as u16, &self.data);
        frame.map_or_else(Vec::new, |frame| slcan::encode(&frame).to_vec())
    }

    /// First 11 bits of the identifier, and the other 18 of one with 29.
    const fn identifier(&self) -> (u32, u32) {
        if self.is_extended { (self.id >> 18, self.id & 0x3_FFFF) } else { (self.id, 0) }
    }

    /// Rank in the arbitration, by the bits in their order on the bus; the lowest wins.
    const fn rank(&self) -> (u32, bool, bool, u32, bool) {
        let (first, others) = self.identifier();
        (first, self.is_extended || self.is_remote, self.is_extended, others, self.is_remote)
    }

    /// Identifier as in `RIxR` and in a 32-bit filter.
    const fn wide(&self) -> u32 {
        let identifier = if self.is_extended { self.id << EXID | IDE } else { self.id << STID };
        if self.is_remote { identifier | RTR } else { identifier }
    }

    /// Identifier as in a 16-bit filter (RM0090, 32.7.4).
    const fn narrow(&self) -> u32 {
        let (first, others) = self.identifier();
        first << 5 | (self.is_remote as u32) << 4 | (self.is_extended as u32) << 3 | others >> 15
    }

    /// Number of bits on the bus, with stuff bits and the three bits between frames.
    #[must_use]
    pub fn bits(&self) -> u64 {
        let mut bits = Vec::with_capacity(128);
        let mut push = |value: u64, count: u32| {
            bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
        };
        let (first, others) = self.identifier();
        push(0, 1);
        push(u64::from(first), 11);
        if self.is_extended {
            // SRR and IDE.
            push(0b11, 2);
            push(u64::from(others), 18);
        }
        push(u64::from(self.is_remote), 1);
        // IDE of a short identifier, and reserved bits.
        push(0, 2);
        let length = self.data.len() as u64;
        push(length, 4);
        for &byte in self.data.iter().filter(|_| !self.is_remote) {
            push(u64::from(byte), 8);
        }
        let crc = bits.iter().fold(0_u32, |crc, &bit| {
            let out = crc >> 14 & 1 == 1;
            let crc = crc << 1 & 0x7FFF;
            if out == bit { crc } else { crc ^ 0x4599 }
        });
        bits.extend((0..15).rev().map(|bit| crc >> bit & 1 == 1));
        let (mut stuffed, mut run, mut last) = (0, 0, None);
        for bit in bits {
            stuffed += 1;
            run = if last == Some(bit) { run + 1 } else { 1 };
            last = Some(bit);
            if run == 5 {
                stuffed += 1;
                (run, last) = (1, Some(!bit));
            }
        }
        // CRC delimiter, acknowledge and its delimiter, end of frame, intermission.
        stuffed + 1 + 2 + 7 + 3
    }
}

/// A frame on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedFrame {
    /// Time of its end, in units of [`time`](crate::emulator::time).
    pub time: u64,
    /// The frame.
    pub frame: BusFrame,
}

// Offsets of the registers (RM0090, 32.9.5).
const MCR: u32 = 0x000;
const MSR: u32 = 0x004;
const TSR: u32 = 0x008;
const RF0R: u32 = 0x00C;
const RF1R: u32 = 0x010;
const IER: u32 = 0x014;
const ESR: u32 = 0x018;
const BTR: u32 = 0x01C;
/// First register of the three mailboxes, each with `TIxR`, `TDTxR`, `TDLxR` and `TDHxR`.
const TI0R: u32 = 0x180;
/// First register of the outputs of the two FIFOs, each with `RIxR`, `RDTxR`, `RDLxR` and `RDHxR`.
const RI0R: u32 = 0x1B0;
const FIFOS_END: u32 = 0x1D0;
const FMR: u32 = 0x200;
const FM1R: u32 = 0x204;
const FS1R: u32 = 0x20C;
const FFA1R: u32 = 0x214;
const FA1R: u32 = 0x21C;
/// First register of the 28 filter banks, each with `FxR1` and `FxR2`.
const F0R1: u32 = 0x240;
const FILTERS_END: u32 = 0x320;

// Bits of MCR.
const INRQ: u32 = 1;
const SLEEP: u32 = 1 << 1;
const TXFP: u32 = 1 << 2;
const RFLM: u32 = 1 << 3;
const NART: u32 = 1 << 4;
const ABOM: u32 = 1 << 6;
const RESET: u32 = 1 << 15;
const DBF: u32 = 1 << 16;

// Bits of MSR.
const INAK: u32 = 1;
const SLAK: u32 = 1 << 1;
const ERRI: u32 = 1 << 2;
const WKUI: u32 = 1 << 3;
const SLAKI: u32 = 1 << 4;
const SAMP: u32 = 1 << 10;
const RX: u32 = 1 << 11;

// Bits of TSR for mailbox 0. The bits of mailbox x are 8 · x higher.
const RQCP: u32 = 1;
const TXOK: u32 = 1 << 1;
const ALST: u32 = 1 << 2;
const TERR: u32 = 1 << 3;
const ABRQ: u32 = 1 << 7;
/// `RQCP` of all mailboxes.
const RQCPS: u32 = RQCP | RQCP << 8 | RQCP << 16;
/// Positions of `CODE`, and of `TME` of mailbox 0.
const CODE: u32 = 24;
const TME: u32 = 26;

// Bits of RF0R and RF1R.
const FULL: u32 = 1 << 3;
const FOVR: u32 = 1 << 4;
const RFOM: u32 = 1 << 5;

// Bits of IER. The bits of FIFO 1 are three higher than the bits of FIFO 0.
const TMEIE: u32 = 1;
const FMPIE0: u32 = 1 << 1;
const FFIE0: u32 = 1 << 2;
const FOVIE0: u32 = 1 << 3;
const LECIE: u32 = 1 << 11;
const ERRIE: u32 = 1 << 15;
/// Position of `EWGIE`, `EPVIE` and `BOFIE`, which are in the order of their flags in `ESR`.
const EWGIE: u32 = 8;

// Bits of ESR, and positions of its counts.
const EWGF: u32 = 1;
const EPVF: u32 = 1 << 1;
const BOFF: u32 = 1 << 2;
const LEC: u32 = 4;
const TEC: u32 = 16;
const REC: u32 = 24;
/// Values of `LEC`.
const ACKNOWLEDGMENT_ERROR: u32 = 3;
const BIT_DOMINANT_ERROR: u32 = 5;

// Fields of BTR.
const BRP: u32 = 0x3FF;
const TS1: u32 = 16;
const TS2: u32 = 20;
const LBKM: u32 = 1 << 30;
const SILM: u32 = 1 << 31;
/// Bit timing after a reset.
const RESET_TIMING: u32 = 0x0123_0000;

// Bits of the registers of a mailbox and of the output of a FIFO.
const TXRQ: u32 = 1;
const RTR: u32 = 1 << 1;
const IDE: u32 = 1 << 2;
const STID: u32 = 21;
const EXID: u32 = 3;
const DLC: u32 = 0xF;
const FMI: u32 = 8;

// Bits of FMR.
const FINIT: u32 = 1;
const CAN2SB: u32 = 8;

/// Number of frames in a full FIFO.
const FIFO_LENGTH: usize = 3;

/// A frame that waits for transmission.
#[derive(Clone, Debug, Default)]
struct Mailbox {
    /// `TIxR` without `TXRQ`, `TDTxR`, `TDLxR` and `TDHxR`.
    registers: [u32; 4],
    /// Whether `TXRQ` is set.
    pending: bool,
    order: u64,
}

impl Mailbox {
    fn frame(&self) -> BusFrame {
        let [identifier, length, low, high] = self.registers;
        let mut data = [low.to_le_bytes(), high.to_le_bytes()].concat();
        data.truncate((length & DLC) as usize);
        BusFrame { id: identifier >> STID, data, ..BusFrame::default() }
    }
}

impl Can {
    /// Creates a controller after reset.
    #[must_use]
    pub fn new(pclk: u32) -> Self {
        Self {
            mcr: DBF | SLEEP,
            msr: SLAK,
            btr: RESET_TIMING,
            fmr: 0x2A1C_0E01,
            pclk,
            joined_at: NEVER,
            ..Self::default()
        }
    }

    /// Resets the controller, but not the bus.
    pub fn reset(&mut self, pclk: u32, now: u64) {
        *self = Self {
            now,
            fault: self.fault,
            sent: core::mem::take(&mut self.sent),
            requested: core::mem::take(&mut self.requested),
            incoming: core::mem::take(&mut self.incoming),
            overruns: self.overruns,
            ..Self::new(pclk)
        };
    }

    /// The bit rate, hertz.
    #[must_use]
    pub const fn bit_rate(&self) -> u32 {
        let quanta = 3 + (self.btr >> TS1 & 0xF) + (self.btr >> TS2 & 7);
        self.pclk / ((self.btr & BRP) + 1) / quanta
    }

    const fn bit(&self) -> u64 {
        cycle(self.bit_rate())
    }

    /// Queues a frame of the other node, to be sent no earlier than `time`.
    pub fn push(&mut self, frame: BusFrame, time: u64) {
        self.incoming.push_back(TimedFrame { time, frame });
    }

    /// Discards frames of the other node that should have begun before `time`.
    pub fn withdraw(&mut self, time: u64) {
        // The first frame may already be on the bus, and completes.
        let on_bus = usize::from(matches!(self.busy, Some((Sender::Peer, _))));
        let waiting = self.incoming.iter().skip(on_bus);
        let late = waiting.take_while(|timed| timed.time < time).count();
        self.incoming.drain(on_bus..on_bus + late);
    }

    const fn is_normal(&self) -> bool {
        self.msr & (INAK | SLAK) == 0
    }

    /// Returns whether the controller takes part in bus traffic: it is initialised, and not off the bus.
    #[must_use]
    pub const fn takes_part(&self) -> bool {
        self.is_normal() && !self.off
    }
}

impl Can {
    /// Lines of the transmit, the two receive and the status interrupts.
    #[must_use]
    pub fn lines(&self) -> [bool; 4] {
        let fifo = |index: usize| {
            let shift = 3 * index;
            self.ier & FMPIE0 << shift != 0 && !self.fifo[index].is_empty()
                || self.ier & FFIE0 << shift != 0 && self.rfr[index] & FULL != 0
                || self.ier & FOVIE0 << shift != 0 && self.rfr[index] & FOVR != 0
        };
        [
            self.ier & TMEIE != 0 && self.tsr & RQCPS != 0,
            fifo(0),
            fifo(1),
            self.ier & ERRIE != 0 && self.msr & ERRI != 0,
        ]
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32, now: u64) -> Result<u32, String> {
        self.advance(now);
        Ok(match offset {
            MCR => self.mcr & !RESET,
            // The receive pin is recessive while no node sends.
            MSR => self.msr | SAMP | RX,
            TSR => {
                let empty = (0..)
                    .zip(&self.mailboxes)
                    .filter(|(_, mailbox)| !mailbox.pending)
                    .fold(0, |word, (index, _)| word | 1 << (TME + index));
                let code = self
                    .mailboxes
                    .iter()
                    .position(|mailbox| !mailbox.pending)
                    .or_else(|| self.next_mailbox())
                    .unwrap_or(0) as u32;
                self.tsr | empty | code << CODE
            }
            RF0R | RF1R => {
                let index = usize::from(offset == RF1R);
                self.fifo[index].len() as u32 | self.rfr[index]
            }
            IER => self.ier,
            ESR => {
                self.error_state()
                    | self.last_error << LEC
                    | (self.transmit_errors & 0xFF) << TEC
                    | (self.receive_errors & 0xFF) << REC
            }
            BTR => self.btr,
            TI0R..RI0R => {
                let (index, register) = place(offset - TI0R, 4);
                let mailbox = &self.mailboxes[index];
                let request = if mailbox.pending && register == 0 { TXRQ } else { 0 };
                mailbox.registers[register] | request
            }
            RI0R..FIFOS_END => {
                let (index, register) = place(offset - RI0R, 4);
                self.fifo[index].front().map_or(0, |entry| entry[register])
            }
            FMR => self.fmr,
            FM1R => self.fm1r,
            FS1R => self.fs1r,
            FFA1R => self.ffa1r,
            FA1R => self.fa1r,
            F0R1..FILTERS_END => {
                let (bank, register) = place(offset - F0R1, 2);
                self.filters[bank][register]
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
            MCR if value & RESET != 0 => self.reset(self.pclk, now),
            MCR => self.set_control(value)?,
            MSR => self.msr &= !(value & (ERRI | WKUI | SLAKI)),
            TSR => {
                for index in 0..self.mailboxes.len() {
                    self.write_transmit_status(index, value >> (8 * index));
                }
            }
            RF0R | RF1R => {
                let index = usize::from(offset == RF1R);
                self.rfr[index] &= !(value & (FULL | FOVR));
                if value & RFOM != 0 {
                    self.fifo[index].pop_front();
                    self.rfr[index] &= !FULL;
                }
            }
            IER => self.ier = value,
            ESR => self.last_error = value >> LEC & 7,
            BTR if self.msr & INAK == 0 => {
                return Err("the bit timing is set outside initialisation".into());
            }
            BTR => self.btr = value,
            TI0R..RI0R => {
                let (index, register) = place(offset - TI0R, 4);
                self.write_mailbox(index, register, value, now)?;
            }
            FMR => self.fmr = value & 0x3F01 | 0x2A1C_0000,
            FM1R | FS1R if self.fmr & FINIT == 0 => {
                return Err("filters are set outside their initialisation".into());
            }
            FM1R => self.fm1r = value,
            FS1R => self.fs1r = value,
            FFA1R => self.ffa1r = value,
            FA1R => self.fa1r = value,
            F0R1..FILTERS_END => {
                let (bank, register) = place(offset - F0R1, 2);
                self.filters[bank][register] = value;
            }
            _ => return unknown("CAN", offset),
        }
        Ok(())
    }

    /// Writes the bits of a mailbox in `TSR`: clears its flags, or aborts its request.
    fn write_transmit_status(&mut self, index: usize, bits: u32) {
        let shift = 8 * index;
        if bits & RQCP != 0 {
            self.tsr &= !((RQCP | TXOK | ALST | TERR) << shift);
        }
        if bits & ABRQ != 0 && self.mailboxes[index].pending {
            self.tsr |= ABRQ << shift;
            // The frame on the bus is completed first.
            let sending = matches!(self.busy, Some((Sender::Mailbox(at), _)) if at == index);
            if !sending && self.is_aborted(index) {
                self.complete(index, false);
            }
        }
    }

    /// Writes a register of a mailbox. `TXRQ` in its `TIxR` requests the transmission.
    fn write_mailbox(
        &mut self,
        index: usize,
        register: usize,
        value: u32,
        now: u64,
    ) -> Result<(), String> {
        let order = self.order;
        let mailbox = &mut self.mailboxes[index];
        if mailbox.pending {
            return Err("a mailbox is written while its frame waits".into());
        }
        if register != 0 {
            mailbox.registers[register] = value;
            return Ok(());
        }
        if value & (IDE | RTR) != 0 {
            return Err("sending 29-bit identifiers and remote frames is not modelled".into());
        }
        mailbox.registers[register] = value & !TXRQ;
        if value & TXRQ != 0 {
            mailbox.pending = true;
            mailbox.order = order;
            let id = mailbox.frame().id;
            self.requested.push((now, id));
            self.order += 1;
            self.tsr &= !((RQCP | TXOK | ALST | TERR) << (8 * index));
        }
        Ok(())
    }

    /// Enters initialisation mode, if requested.
    const fn acknowledge(&mut self) {
        if self.mcr & INRQ == 0 {
            return;
        }
        self.msr = self.msr & !SLAK | INAK;
        self.joined_at = NEVER;
        if self.mcr & SLEEP == 0 {
            // Initialisation ends bus-off after a time; the model ends it at once.
            self.off = false;
        }
    }

    fn set_control(&mut self, value: u32) -> Result<(), String> {
        let old = core::mem::replace(&mut self.mcr, value & (DBF | 0xFF));
        if value & INRQ != 0 {
            // The frame on the bus is completed first, and a bus that is never idle delays this indefinitely.
            let is_held = self.busy.is_some() || self.is_shorted();
            if !(self.is_normal() && is_held) {
                self.acknowledge();
            }
        } else if value & SLEEP != 0 {
            self.msr = self.msr & !INAK | SLAK;
            self.joined_at = NEVER;
        } else if old & (INRQ | SLEEP) != 0 {
            if self.btr == RESET_TIMING {
                return Err("the bus is joined at the bit timing after a reset".into());
            }
            // Synchronises to eleven recessive bits.
            self.wait_for_idle(11);
        }
        Ok(())
    }

    fn next_mailbox(&self) -> Option<usize> {
        (0..3).filter(|&index| self.mailboxes[index].pending).min_by_key(|&index| {
            let mailbox = &self.mailboxes[index];
            let rank = match self.mcr & TXFP {
                0 => u64::from(mailbox.frame().id),
                _ => mailbox.order,
            };
            (rank, index)
        })
    }

    /// Returns whether the program has withdrawn the frame of a mailbox, and the controller obeys.
    fn is_aborted(&self, index: usize) -> bool {
        self.tsr >> (8 * index) & ABRQ != 0 && self.fault != BusFault::AbortIgnored
    }

    fn complete(&mut self, index: usize, sent: bool) {
        self.mailboxes[index].pending = false;
        let shift = 8 * index;
        self.tsr &= !((ABRQ | RQCP | TXOK | ALST | TERR) << shift);
        self.tsr |= (if sent { RQCP | TXOK } else { RQCP }) << shift;
    }
}

impl Can {
    /// Time of the next event on the bus.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        let mut next = self.joined_at;
        if let Some((_, end)) = self.busy {
            return end;
        }
        if self.starts_now() {
            next = next.min(self.now);
        }
        if self.is_normal()
            && self.hears_others()
            && let Some(first) = self.incoming.front()
        {
            next = next.min(first.time);
        }
        next
    }

    fn starts_now(&self) -> bool {
        let own = self.takes_part() && self.mailboxes.iter().any(|mailbox| mailbox.pending);
        own || (self.fault == BusFault::Saturated && self.is_normal() && self.hears_others())
    }

    fn hears_others(&self) -> bool {
        self.btr & LBKM == 0 && matches!(self.fault, BusFault::None | BusFault::Saturated)
    }

    /// Returns whether the controller sees a shorted bus. In loop-back mode it disregards its pin (RM0090, 32.5.3).
    fn is_shorted(&self) -> bool {
        self.fault == BusFault::Shorted && self.btr & LBKM == 0
    }

    /// Advances to `now`.
    pub fn advance(&mut self, now: u64) {
        loop {
            if self.joined_at <= now && self.busy.is_none() {
                self.join(self.joined_at);
            }
            match self.busy {
                Some((sender, end)) if end <= now => {
                    self.busy = None;
                    self.now = end;
                    self.finish(sender, end);
                    if !self.is_shorted() {
                        self.acknowledge();
                    }
                }
                Some(_) => break,
                None => {
                    let peer = match self.incoming.front() {
                        Some(first) if self.hears_others() => first.time,
                        _ => NEVER,
                    };
                    let start = if self.starts_now() { self.now } else { peer.max(self.now) };
                    if start <= now && self.is_normal() {
                        self.arbitrate(start);
                    }
                    if self.busy.is_none() {
                        self.now = now;
                        break;
                    }
                }
            }
        }
    }

    /// Selects the winner: the lowest identifier among the next mailbox and the other nodes.
    fn arbitrate(&mut self, start: u64) {
        let own = self.next_mailbox().filter(|_| self.takes_part());
        let connected = self.hears_others();
        let peer = self
            .incoming
            .front()
            .filter(|first| connected && first.time <= start)
            .map(|first| first.frame.clone());
        let flood = (self.fault == BusFault::Saturated && connected).then(flooding);
        let rivals = [
            own.map(|index| (self.mailboxes[index].frame(), Sender::Mailbox(index))),
            peer.map(|frame| (frame, Sender::Peer)),
            flood.map(|frame| (frame, Sender::Flood)),
        ];
        let Some((frame, sender)) =
            rivals.into_iter().flatten().min_by_key(|(frame, _)| frame.rank())
        else {
            return;
        };
        if let Some(index) = own
            && sender != Sender::Mailbox(index)
        {
            self.tsr |= ALST << (8 * index);
            if self.mcr & NART != 0 {
                self.complete(index, false);
            }
        }
        // An error flag ends a frame early, so no bit after the first few is sent.
        let bits = if self.is_shorted() { 1 + 6 + 8 + 3 } else { frame.bits() };
        let length = bits * self.bit();
        self.busy = Some((sender, start + length));
    }

    fn finish(&mut self, sender: Sender, time: u64) {
        match sender {
            Sender::Mailbox(index) => {
                let alone = self.btr & (LBKM | SILM) == 0;
                let error = match self.fault {
                    BusFault::Shorted if alone => Some(BIT_DOMINANT_ERROR),
                    BusFault::NoAcknowledge | BusFault::AbortIgnored if alone => {
                        Some(ACKNOWLEDGMENT_ERROR)
                    }
                    _ => None,
                };
                if let Some(code) = error {
                    self.last_error = code;
                    // A passive node does not count further errors without an acknowledge.
                    if !(code == ACKNOWLEDGMENT_ERROR && self.transmit_errors >= 128) {
                        self.transmit_errors += 8;
                    }
                    self.tsr |= TERR << (8 * index);
                    if self.mcr & NART != 0 || self.is_aborted(index) {
                        self.complete(index, false);
                        self.tsr |= TERR << (8 * index);
                    }
                    self.error_raised();
                } else {
                    let frame = self.mailboxes[index].frame();
                    self.transmit_errors = self.transmit_errors.saturating_sub(1);
                    self.last_error = 0;
                    self.complete(index, true);
                    if self.btr & LBKM != 0 {
                        self.receive(&frame);
                    }
                    if self.btr & SILM == 0 {
                        self.sent.push(TimedFrame { time, frame });
                    }
                }
            }
            Sender::Peer => {
                if let Some(TimedFrame { frame, .. }) = self.incoming.pop_front()
                    && self.takes_part()
                {
                    self.receive_errors = self.receive_errors.saturating_sub(1);
                    self.last_error = 0;
                    self.receive(&frame);
                }
            }
            Sender::Flood if self.takes_part() => self.receive(&flooding()),
            Sender::Flood => {}
        }
    }

    /// Waits for this many recessive bits until the controller takes part again.
    fn wait_for_idle(&mut self, bits: u64) {
        self.joined_at = if self.is_shorted() { NEVER } else { self.now + bits * self.bit() };
    }

    fn join(&mut self, time: u64) {
        self.joined_at = NEVER;
        self.now = self.now.max(time);
        if self.off {
            self.off = false;
            self.transmit_errors = 0;
            self.receive_errors = 0;
        }
        if self.mcr & (INRQ | SLEEP) == 0 {
            self.msr &= !(INAK | SLAK);
        }
    }

    /// Sets or clears a fault of the bus.
    pub fn set_fault(&mut self, fault: BusFault) {
        let was = core::mem::replace(&mut self.fault, fault);
        if fault != BusFault::Shorted && self.busy.is_none() && self.is_normal() {
            self.acknowledge();
        }
        if was == BusFault::Shorted && self.joined_at == NEVER {
            if self.off && self.mcr & ABOM != 0 {
                self.wait_for_idle(128 * 11);
            } else if !self.is_normal() && self.mcr & (INRQ | SLEEP) == 0 {
                self.wait_for_idle(11);
            }
        }
    }
}

/// Index of the group of `count` registers at this distance from the first group, and of the register in it.
const fn place(distance: u32, count: u32) -> (usize, usize) {
    let register = distance / 4;
    ((register / count) as usize, (register % count) as usize)
}

/// Frame of the node that saturates the bus.
fn flooding() -> BusFrame {
    BusFrame::new(0, &[0x55; 8])
}

impl Can {
    fn error_raised(&mut self) {
        if self.transmit_errors > 255 && !self.off {
            self.off = true;
            self.transmit_errors = 0;
            if self.mcr & ABOM != 0 {
                self.wait_for_idle(128 * 11);
            }
        }
        let state = self.error_state();
        if state & (self.ier >> EWGIE) != 0 || self.ier & LECIE != 0 {
            self.msr |= ERRI;
        }
    }

    /// Error state as in `ESR`.
    const fn error_state(&self) -> u32 {
        let (transmit, receive) = (self.transmit_errors, self.receive_errors);
        let warning = if transmit >= 96 || receive >= 96 || self.off { EWGF } else { 0 };
        let passive = if transmit > 127 || receive > 127 || self.off { EPVF } else { 0 };
        let off = if self.off { BOFF } else { 0 };
        warning | passive | off
    }
}

impl Can {
    /// Puts a frame into the FIFO of the filter that accepts it.
    fn receive(&mut self, frame: &BusFrame) {
        let Some((fifo, index)) = self.filter(frame) else {
            return;
        };
        let word = |from: usize| {
            u32::from_le_bytes(core::array::from_fn(|i| {
                let sent = frame.data.get(from + i).filter(|_| !frame.is_remote);
                sent.copied().unwrap_or(0)
            }))
        };
        let entry = [frame.wide(), frame.data.len() as u32 | index << FMI, word(0), word(4)];
        if self.fifo[fifo].len() == FIFO_LENGTH {
            self.overruns += 1;
            self.rfr[fifo] |= FOVR;
            // Unless the FIFO is locked, the last message is replaced.
            if self.mcr & RFLM == 0 {
                self.fifo[fifo].pop_back();
                self.fifo[fifo].push_back(entry);
            }
            return;
        }
        self.fifo[fifo].push_back(entry);
        if self.fifo[fifo].len() == FIFO_LENGTH {
            self.rfr[fifo] |= FULL;
        }
    }

    /// FIFO and filter number for a frame, if a filter accepts it.
    fn filter(&self, frame: &BusFrame) -> Option<(usize, u32)> {
        if self.fmr & FINIT != 0 {
            return None;
        }
        let (wide, narrow) = (frame.wide(), frame.narrow());
        let banks = (self.fmr >> CAN2SB & 0x3F) as usize;
        let mut numbers = [0_u32; 2];
        for (bank, [first, second]) in self.filters.into_iter().enumerate().take(banks.min(28)) {
            let bit = |word: u32| word >> bank & 1 == 1;
            let fifo = usize::from(bit(self.ffa1r));
            let (list, is_wide) = (bit(self.fm1r), bit(self.fs1r));
            let masked = |value: u32, id: u32, mask: u32| (value ^ id) & mask == 0;
            let hits: Vec<bool> = match (is_wide, list) {
                (true, false) => vec![masked(wide, first, second & !1)],
                (true, true) => vec![wide == first & !1, wide == second & !1],
                (false, false) => {
                    [first, second].map(|word| masked(narrow, word & 0xFFFF, word >> 16)).to_vec()
                }
                (false, true) => [first & 0xFFFF, first >> 16, second & 0xFFFF, second >> 16]
                    .map(|id| narrow == id)
                    .to_vec(),
            };
            if bit(self.fa1r)
                && let Some(hit) = hits.iter().position(|&hit| hit)
            {
                return Some((fifo, numbers[fifo] + hit as u32));
            }
            numbers[fifo] += hits.len() as u32;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn initialisation_is_acknowledged_once_the_bus_is_idle() {
        const MILLISECOND: u64 = crate::emulator::time::PER_SECOND / 1000;
        let acknowledged =
            |can: &mut Can, now: u64| can.read(MSR, now).expect("a register") & INAK != 0;
        let mut can = Can::new(40_000_000);
        can.write(MCR, INRQ, 0).expect("a register");
        assert!(acknowledged(&mut can, 0));
        assert!(can.write(MCR, 0, 0).is_err(), "the timing of the reset");
        for (offset, value) in [(MCR, INRQ), (BTR, 0x0123_0001), (MCR, 0)] {
            can.write(offset, value, 0).expect("a register");
        }
        assert!(!acknowledged(&mut can, MILLISECOND), "it takes part");
        can.set_fault(BusFault::Shorted);
        can.write(MCR, INRQ, MILLISECOND).expect("a register");
        assert!(!acknowledged(&mut can, 100 * MILLISECOND));
        can.set_fault(BusFault::None);
        assert!(acknowledged(&mut can, 100 * MILLISECOND));
    }

    #[test]
    fn silent_loop_back_works_on_a_shorted_bus_and_is_not_seen() {
        const MILLISECOND: u64 = crate::emulator::time::PER_SECOND / 1000;
        let mut can = Can::new(40_000_000);
        can.set_fault(BusFault::Shorted);
        let timing = LBKM | SILM | 0x0123_0001;
        for (offset, value) in [(MCR, INRQ), (BTR, timing), (MCR, 0)] {
            can.write(offset, value, 0).expect("a register");
        }
        // A filter that accepts all.
        for (offset, value) in [(FMR, 0xE00 | FINIT), (FS1R, 1), (FA1R, 1), (FMR, 0xE00)] {
            can.write(offset, value, 0).expect("a register");
        }
        assert_eq!(can.read(MSR, MILLISECOND).expect("a register") & INAK, 0);
        let request = 0x123 << STID | TXRQ;
        can.write(TI0R, request, MILLISECOND).expect("a register");
        let waiting = |can: &mut Can, now| can.read(RF0R, now).expect("a register") & 3;
        assert_eq!(waiting(&mut can, 2 * MILLISECOND), 1);
        assert!(can.sent.is_empty());
        can.write(MCR, INRQ, 2 * MILLISECOND).expect("a register");
        let status = can.read(MSR, 2 * MILLISECOND).expect("a register");
        assert_ne!(status & INAK, 0);
    }

    #[test]
    fn filters_tell_frames_of_both_lengths_and_remote_frames_apart() {
        let short = BusFrame::new(0x555, &[1]);
        let remote = BusFrame { is_remote: true, ..short.clone() };
        let long = BusFrame { id: 0x555 << 18 | 0x2_8001, is_extended: true, ..short.clone() };
        // RM0090, figure 342: STID or EXID, IDE and RTR.
        assert_eq!(short.wide(), 0x555 << 21);
        assert_eq!(remote.wide(), 0x555 << 21 | 0b010);
        assert_eq!(long.wide(), 0x555 << 21 | 0x2_8001 << 3 | 0b100);
        assert_eq!([short.narrow(), remote.narrow()], [0x555 << 5, 0x555 << 5 | 1 << 4]);
        assert_eq!(long.narrow(), 0x555 << 5 | 1 << 3 | 0b101);
        // A dominant bit wins: RTR of a data frame, then IDE of a short identifier.
        assert!(short.rank() < remote.rank() && remote.rank() < long.rank());
        // 20 more bits of arbitration; a remote frame has none of its eight bits of data.
        let bits = [&short, &remote, &long].map(BusFrame::bits);
        assert!(bits[1] + 8 <= bits[0] + 2 && bits[2] >= bits[0] + 19, "{bits:?}");
    }

    #[test]
    fn a_frame_of_eight_bytes_has_the_specified_length() {
        // 111 bits and intermission without a stuffed bit; at most 24 of them with 8 bytes.
        let plain = BusFrame::new(0x555, &[0x55; 8]).bits();
        let stuffed = BusFrame::new(0, &[0; 8]).bits();
        assert!((111..=113).contains(&plain), "{plain}");
        assert!((125..=135).contains(&stuffed), "{stuffed}");
    }
}
