//! DMA controller: eight streams in direct mode or through the FIFO without packing.

use super::unknown;

/// Next transfer of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Address of the peripheral's register.
    pub peripheral: u32,
    /// Address in memory.
    pub memory: u32,
    /// Size, bytes.
    pub size: usize,
    /// Whether the transfer is to the peripheral.
    pub to_peripheral: bool,
}

/// One stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct DmaStream {
    control: u32,
    left: u32,
    length: u32,
    peripheral: u32,
    memory: u32,
    fifo: u32,
    flags: u32,
    done: u32,
}

// Offsets of the registers (RM0090, 10.5).
const LISR: u32 = 0x00;
const HISR: u32 = 0x04;
const LIFCR: u32 = 0x08;
const HIFCR: u32 = 0x0C;
/// First register of the eight streams.
const STREAMS: u32 = 0x10;
const STREAMS_END: u32 = 0xD0;
const STREAM_SIZE: u32 = 0x18;

// Offsets of the registers of a stream.
const CR: u32 = 0x00;
const NDTR: u32 = 0x04;
const PAR: u32 = 0x08;
const M0AR: u32 = 0x0C;
const M1AR: u32 = 0x10;

// Bits of a stream's CR, and its flags.
const EN: u32 = 1;
const CIRC: u32 = 1 << 8;
const PINC: u32 = 1 << 9;
const MINC: u32 = 1 << 10;
const DBM: u32 = 1 << 18;

const TC: u32 = 1 << 5;
const HT: u32 = 1 << 4;
const TE: u32 = 1 << 3;

impl DmaStream {
    /// Channel of the stream; `None` while it is disabled.
    #[must_use]
    pub fn channel(&self) -> Option<u32> {
        (self.control & EN != 0).then_some(self.control >> 25 & 7)
    }

    /// Next item to transfer.
    #[must_use]
    pub fn item(&self) -> Item {
        let size = 1_usize << (self.control >> 11 & 3);
        let offset = |increment: u32| match self.control & increment {
            0 => 0,
            _ => self.done * size as u32,
        };
        Item {
            peripheral: self.peripheral + offset(PINC),
            memory: self.memory + offset(MINC),
            size,
            to_peripheral: self.control >> 6 & 3 == 1,
        }
    }

    /// Advances after the transfer of an item, or stops after its bus error, for instance an unmapped address.
    const fn moved(&mut self, worked: bool) {
        if !worked {
            self.flags |= TE;
            self.control &= !EN;
            return;
        }
        self.done += 1;
        self.left -= 1;
        if self.left == self.length / 2 {
            self.flags |= HT;
        }
        if self.left == 0 {
            self.flags |= TC;
            self.done = 0;
            if self.control & CIRC != 0 {
                self.left = self.length;
            } else {
                self.control &= !EN;
            }
        }
    }

    /// Returns whether at least half of the items have been transferred.
    #[must_use]
    pub const fn is_half_done(&self) -> bool {
        self.left <= self.length / 2
    }

    /// Returns whether the interrupt is requested.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        // TCIE, HTIE, TEIE, DMEIE are bits 4, 3, 2, 1; their flags 5, 4, 3, 2.
        self.flags & (self.control & 0x1E) << 1 != 0
    }
}

/// The controller.
#[derive(Clone, Debug, Default)]
pub struct Dma {
    /// Streams of the controller.
    pub streams: [DmaStream; 8],
    /// Streams that are enabled, one bit each.
    running: u8,
}

/// Positions of the flags of four streams in a register.
const SHIFTS: [u32; 4] = [0, 6, 16, 22];

impl Dma {
    /// Streams that are enabled, in order.
    pub fn running(&self) -> impl Iterator<Item = usize> + use<> {
        let mut left = self.running;
        core::iter::from_fn(move || {
            let stream = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            (stream < 8).then_some(stream)
        })
    }

    /// Advances a stream after the transfer of an item, or stops it after its bus error.
    pub fn moved(&mut self, stream: usize, worked: bool) {
        self.streams[stream].moved(worked);
        self.note(stream);
    }

    /// Notes whether a stream is enabled.
    fn note(&mut self, stream: usize) {
        let is_on = self.streams[stream].channel().is_some();
        self.running = self.running & !(1 << stream) | u8::from(is_on) << stream;
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        match offset {
            LISR | HISR => {
                let first = offset as usize;
                Ok((0..4).fold(0, |word, i| word | self.streams[first + i].flags << SHIFTS[i]))
            }
            LIFCR | HIFCR => Ok(0),
            STREAMS..STREAMS_END => {
                let stream = &self.streams[((offset - STREAMS) / STREAM_SIZE) as usize];
                Ok(match (offset - STREAMS) % STREAM_SIZE {
                    CR => stream.control,
                    NDTR => stream.left,
                    PAR => stream.peripheral,
                    M0AR => stream.memory,
                    M1AR => 0,
                    _ => stream.fifo | 0x20,
                })
            }
            _ => unknown("DMA", offset),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            LIFCR | HIFCR => {
                let first = (offset - LIFCR) as usize;
                for (i, shift) in SHIFTS.into_iter().enumerate() {
                    self.streams[first + i].flags &= !(value >> shift & 0x3D);
                }
            }
            STREAMS..STREAMS_END => {
                let number = ((offset - STREAMS) / STREAM_SIZE) as usize;
                let stream = &mut self.streams[number];
                let register = (offset - STREAMS) % STREAM_SIZE;
                let on = stream.control & EN != 0;
                if on && matches!(register, NDTR | PAR) {
                    return Err("a stream of DMA is set while it runs".into());
                }
                match register {
                    CR => {
                        let set = stream.set_control(value);
                        self.note(number);
                        set?;
                    }
                    NDTR => stream.left = value & 0xFFFF,
                    PAR => stream.peripheral = value,
                    M0AR => stream.memory = value,
                    M1AR => {}
                    _ => stream.fifo = value & 0x87,
                }
            }
            _ => return unknown("DMA", offset),
        }
        Ok(())
    }
}

impl DmaStream {
    fn set_control(&mut self, value: u32) -> Result<(), String> {
        let was_on = self.control & EN != 0;
        self.control = value & 0x0FEF_FFFF;
        if value & EN == 0 {
            if was_on {
                // A stream that is switched off early reports completion.
                self.flags |= TC;
            }
            return Ok(());
        }
        if was_on {
            return Ok(());
        }
        if value >> 6 & 3 > 1 || value & DBM != 0 {
            return Err("DMA from memory to memory, and with two buffers, is not modelled".into());
        }
        if value >> 11 & 3 != value >> 13 & 3 {
            return Err("DMA that packs is not modelled".into());
        }
        if self.flags != 0 {
            return Err("a stream of DMA is started with flags of its last run".into());
        }
        if self.left == 0 {
            self.control &= !EN;
            return Ok(());
        }
        self.length = self.left;
        self.done = 0;
        Ok(())
    }
}
