//! Loads and stores of the core and of DMA: the mapping of addresses to peripherals.

use super::Chip;
use super::map::{MAP, PART_SIZE, Part};
use crate::emulator::memory::{FLASH, Memory};
use crate::emulator::part::dma::Dma;
use crate::emulator::part::pwr::Pwr;
use crate::emulator::part::tim11::Tim11;
use crate::emulator::time::cycle;

/// Offset of the data register of a serial line.
const USART_DR: u32 = 0x04;

/// Offsets of the identifiers of the transmit mailboxes; bit 0 requests the transmission.
const MAILBOXES: [u32; 3] = [0x180, 0x190, 0x1A0];

impl Chip {
    /// A load by the core.
    ///
    /// # Errors
    /// If the peripheral is not modelled or not clocked.
    pub fn read(
        &mut self,
        memory: &mut dyn Memory,
        now: u64,
        address: u32,
        size: usize,
    ) -> Result<u32, String> {
        let value = self.read_part(now, address)?;
        self.serve_dma(memory, now)?;
        let shift = 8 * (address & 3);
        Ok(value >> shift & (u64::from(u32::MAX) >> (32 - 8 * size.min(4))) as u32)
    }

    /// A store by the core.
    ///
    /// # Errors
    /// If the peripheral is not modelled or not clocked, or refuses the value.
    pub fn write(
        &mut self,
        memory: &mut dyn Memory,
        now: u64,
        address: u32,
        size: usize,
        value: u32,
    ) -> Result<(), String> {
        if FLASH.contains(address) {
            self.flash.reset_at = self.iwdg.next_event();
            return self.flash.program(address, size, value, now, memory);
        }
        self.write_part(memory, now, address, size, value)?;
        self.serve_dma(memory, now)
    }

    /// The peripheral at an address, and the offset into it.
    fn locate(&self, address: u32) -> Result<(Part, u32), String> {
        let entry = MAP
            .iter()
            .find(|entry| address >= entry.base && address - entry.base < PART_SIZE)
            .ok_or_else(|| "a peripheral that is not modelled".to_owned())?;
        if let Some((register, bit)) = entry.enable
            && !self.rcc.is_enabled(register, bit)
        {
            return Err(format!("{} is not clocked", entry.name));
        }
        Ok((entry.part, address - entry.base))
    }

    /// Reads a register, as a word.
    pub(super) fn read_part(&mut self, now: u64, address: u32) -> Result<u32, String> {
        let (part, offset) = self.locate(address)?;
        let offset = offset & !3;
        match part {
            Part::Timer(index) => self.timers[index].read(offset, now),
            Part::Tim11 => {
                let clock = cycle(self.rcc.clocks.timers2);
                self.tim11.read(offset, now, clock, self.rcc.hse_rtc(now))
            }
            Part::Spi(index) => self.spis[index].read(offset),
            Part::Usart(index) => self.usarts[index].read(offset),
            Part::Can => self.can.read(offset, now),
            Part::Pwr => self.pwr.read(offset, self.flash.supply_mv, now),
            Part::Iwdg => self.iwdg.read(offset),
            Part::Adc => self.adc.read(offset, now),
            Part::Gpio(index) => {
                if index == self.wiring.data_ready.port {
                    self.with_sensor(now, |_| ());
                }
                self.ports[index].read(offset)
            }
            Part::Rcc => self.rcc.read(offset, now),
            Part::Flash => self.flash.read(offset),
            Part::Dma(index) => self.dmas[index].read(offset),
        }
    }

    /// Writes a register.
    pub(super) fn write_part(
        &mut self,
        memory: &mut dyn Memory,
        now: u64,
        address: u32,
        size: usize,
        value: u32,
    ) -> Result<(), String> {
        let (part, offset) = self.locate(address)?;
        let (value, offset) = match (part, size) {
            (_, 4) => (value, offset),
            // Data registers take the width of the store; other registers take words.
            (Part::Spi(_), 1 | 2) if offset == 0xC => (value & 0xFF, offset),
            (Part::Usart(_), 1 | 2) if offset == 4 => (value & 0x1FF, offset),
            (_, 2) if offset.is_multiple_of(4) => (value & 0xFFFF, offset),
            _ => return Err(format!("a store of {size} bytes to a register")),
        };
        match part {
            Part::Timer(index) => self.timers[index].write(offset, value, now),
            Part::Tim11 => self.tim11.write(offset, value, now),
            Part::Spi(index) => {
                let pclk = self.spi_clock(index);
                self.spis[index].write(offset, value, now, pclk)?;
                self.check_sensor_bus(index, offset, pclk)
            }
            Part::Usart(index) => {
                if index == self.wiring.usart && offset == USART_DR {
                    self.check_connections(&self.wiring.serial)?;
                }
                let pclk = self.usart_clock(index);
                self.usarts[index].write(offset, value, now, pclk)
            }
            Part::Can => {
                if MAILBOXES.contains(&offset) && value & 1 == 1 {
                    self.check_connections(&self.wiring.can)?;
                }
                self.can.write(offset, value, now)
            }
            Part::Pwr => self.pwr.write(offset, value, now),
            Part::Iwdg => self.iwdg.write(offset, value, now),
            Part::Adc => {
                let pclk = self.rcc.clocks.pclk2;
                self.adc.write(offset, value, now, pclk)
            }
            Part::Gpio(index) => {
                self.ports[index].write(offset, value)?;
                if index == self.wiring.select.port {
                    self.update_select(now);
                }
                self.check_tied_pins(index)
            }
            Part::Rcc => self.write_rcc(offset, value, now),
            Part::Flash => {
                self.flash.reset_at = self.iwdg.next_event();
                self.flash.write(offset, value, now, memory)?;
                self.rcc.check_wait_states(self.flash.wait_states())
            }
            Part::Dma(index) => self.dmas[index].write(offset, value),
        }
    }

    /// Resets one peripheral.
    pub(super) fn reset_part(&mut self, part: Part, now: u64) {
        let clocks = self.rcc.clocks;
        match part {
            Part::Timer(index) => self.timers[index].reset(cycle(clocks.timers1)),
            Part::Tim11 => self.tim11 = Tim11::default(),
            Part::Spi(index) => self.spis[index].reset(),
            Part::Usart(index) => self.usarts[index].reset(),
            Part::Can => self.can.reset(clocks.pclk1, now),
            Part::Pwr => self.pwr = Pwr::default(),
            Part::Adc => self.adc.reset(),
            Part::Gpio(index) => {
                self.ports[index].reset();
                self.update_select(now);
            }
            Part::Dma(index) => self.dmas[index] = Dma::default(),
            Part::Iwdg | Part::Rcc | Part::Flash => {}
        }
    }
}
