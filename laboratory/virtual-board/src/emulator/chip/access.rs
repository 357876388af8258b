//! Loads and stores of the core and of DMA: the peripheral at an address, and whether it is clocked.

use super::Chip;
use crate::emulator::memory::{FLASH, Memory};
use crate::emulator::part::dma::Dma;
use crate::emulator::part::pwr::Pwr;
use crate::emulator::part::rcc::HERTZ_A_STATE;
use crate::emulator::part::tim11::Tim11;
use crate::emulator::time::cycle;

/// A peripheral.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Timer(usize),
    Tim11,
    Spi(usize),
    Usart(usize),
    Can,
    Pwr,
    Iwdg,
    Adc,
    Gpio(usize),
    Rcc,
    Flash,
    Dma(usize),
}

/// Size of the registers of a peripheral, bytes.
pub(super) const PART_SIZE: u32 = 0x400;

/// The address of a peripheral, and the bit that enables its clock.
pub(super) struct Entry {
    pub(super) name: &'static str,
    pub(super) base: u32,
    pub(super) part: Part,
    /// Offset of the enable register in RCC, and the bit.
    pub(super) enable: Option<(u32, u32)>,
}

const fn entry(name: &'static str, base: u32, part: Part, enable: Option<(u32, u32)>) -> Entry {
    Entry { name, base, part, enable }
}

const AHB1: u32 = 0x30;
const APB1: u32 = 0x40;
const APB2: u32 = 0x44;

/// The address of each peripheral, and the bit that enables its clock (RM0090, table 1 and 7.3).
pub(super) const MAP: [Entry; 29] = [
    entry("TIM2", 0x4000_0000, Part::Timer(0), Some((APB1, 0))),
    entry("TIM3", 0x4000_0400, Part::Timer(1), Some((APB1, 1))),
    entry("TIM4", 0x4000_0800, Part::Timer(2), Some((APB1, 2))),
    entry("TIM5", 0x4000_0C00, Part::Timer(3), Some((APB1, 3))),
    entry("IWDG", 0x4000_3000, Part::Iwdg, None),
    entry("SPI2", 0x4000_3800, Part::Spi(1), Some((APB1, 14))),
    entry("SPI3", 0x4000_3C00, Part::Spi(2), Some((APB1, 15))),
    entry("USART2", 0x4000_4400, Part::Usart(1), Some((APB1, 17))),
    entry("USART3", 0x4000_4800, Part::Usart(2), Some((APB1, 18))),
    entry("CAN1", 0x4000_6400, Part::Can, Some((APB1, 25))),
    entry("PWR", 0x4000_7000, Part::Pwr, Some((APB1, 28))),
    entry("USART1", 0x4001_1000, Part::Usart(0), Some((APB2, 4))),
    entry("USART6", 0x4001_1400, Part::Usart(3), Some((APB2, 5))),
    entry("ADC1", 0x4001_2000, Part::Adc, Some((APB2, 8))),
    entry("SPI1", 0x4001_3000, Part::Spi(0), Some((APB2, 12))),
    entry("TIM11", 0x4001_4800, Part::Tim11, Some((APB2, 18))),
    entry("GPIOA", 0x4002_0000, Part::Gpio(0), Some((AHB1, 0))),
    entry("GPIOB", 0x4002_0400, Part::Gpio(1), Some((AHB1, 1))),
    entry("GPIOC", 0x4002_0800, Part::Gpio(2), Some((AHB1, 2))),
    entry("GPIOD", 0x4002_0C00, Part::Gpio(3), Some((AHB1, 3))),
    entry("GPIOE", 0x4002_1000, Part::Gpio(4), Some((AHB1, 4))),
    entry("GPIOF", 0x4002_1400, Part::Gpio(5), Some((AHB1, 5))),
    entry("GPIOG", 0x4002_1800, Part::Gpio(6), Some((AHB1, 6))),
    entry("GPIOH", 0x4002_1C00, Part::Gpio(7), Some((AHB1, 7))),
    entry("GPIOI", 0x4002_2000, Part::Gpio(8), Some((AHB1, 8))),
    entry("RCC", 0x4002_3800, Part::Rcc, None),
    entry("FLASH", 0x4002_3C00, Part::Flash, None),
    entry("DMA1", 0x4002_6000, Part::Dma(0), Some((AHB1, 21))),
    entry("DMA2", 0x4002_6400, Part::Dma(1), Some((AHB1, 22))),
];

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
                let prefetched = self.flash.prefetches();
                self.flash.write(offset, value, now, memory)?;
                if self.flash.prefetches() && !prefetched {
                    self.check_flash_at_supply()?;
                }
                self.rcc.check_wait_states(self.flash.wait_states(), HERTZ_A_STATE)
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
