//! The address of each peripheral, and the bit that enables its clock (RM0090, table 1 and 7.3).

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
