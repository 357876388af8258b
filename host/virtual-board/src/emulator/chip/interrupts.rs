//! Interrupt line of each peripheral (RM0090, table 62).

use super::Chip;
use crate::emulator::core::nvic::Nvic;

const TIMER_INTERRUPTS: [u16; 4] = [28, 29, 30, 50];
const SPI_INTERRUPTS: [u16; 3] = [35, 36, 51];
const USART_INTERRUPTS: [u16; 4] = [37, 38, 39, 71];
const CAN_INTERRUPTS: [u16; 4] = [19, 20, 21, 22];
const DMA_INTERRUPTS: [[u16; 8]; 2] =
    [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];

impl Chip {
    /// Drives the levels of all interrupt lines.
    pub(crate) fn drive_lines(&self, nvic: &mut Nvic) {
        let mut levels = 0;
        let mut set = |line: u16, level: bool| levels |= u128::from(level) << line;
        for (timer, line) in self.timers.iter().zip(TIMER_INTERRUPTS) {
            set(line, timer.interrupts());
        }
        for (spi, line) in self.spis.iter().zip(SPI_INTERRUPTS) {
            set(line, spi.interrupts());
        }
        for (usart, line) in self.usarts.iter().zip(USART_INTERRUPTS) {
            set(line, usart.interrupts());
        }
        for (level, line) in self.can.lines().into_iter().zip(CAN_INTERRUPTS) {
            set(line, level);
        }
        for (dma, lines) in self.dmas.iter().zip(DMA_INTERRUPTS) {
            for (stream, line) in dma.streams.iter().zip(lines) {
                set(line, stream.interrupts());
            }
        }
        set(4, self.flash.interrupts());
        nvic.set_lines(levels);
    }
}
