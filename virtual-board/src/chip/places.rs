//! Where each peripheral is, and what switches its clock on (RM0090, table 1 and 7.3).

/// A peripheral.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Timer(usize),
    Spi(usize),
    Usart(usize),
    Can,
    Pwr,
    Iwdg,
    Adc,
    Syscfg,
    Exti,
    Gpio(usize),
    Rcc,
    Flash,
    Dma(usize),
}

/// Where a peripheral is and what switches its clock on.
pub(super) struct Place {
    pub(super) name: &'static str,
    pub(super) base: u32,
    pub(super) size: u32,
    pub(super) part: Part,
    /// Offset of the enable register in RCC, and the bit.
    pub(super) enable: Option<(u32, u32)>,
}

const fn place(name: &'static str, base: u32, part: Part, enable: Option<(u32, u32)>) -> Place {
    Place {
        name,
        base,
        size: 0x400,
        part,
        enable,
    }
}

const AHB1: u32 = 0x30;
const APB1: u32 = 0x40;
const APB2: u32 = 0x44;

pub(super) const PLACES: [Place; 30] = [
    place("TIM2", 0x4000_0000, Part::Timer(0), Some((APB1, 0))),
    place("TIM3", 0x4000_0400, Part::Timer(1), Some((APB1, 1))),
    place("TIM4", 0x4000_0800, Part::Timer(2), Some((APB1, 2))),
    place("TIM5", 0x4000_0C00, Part::Timer(3), Some((APB1, 3))),
    place("IWDG", 0x4000_3000, Part::Iwdg, None),
    place("SPI2", 0x4000_3800, Part::Spi(1), Some((APB1, 14))),
    place("SPI3", 0x4000_3C00, Part::Spi(2), Some((APB1, 15))),
    place("USART2", 0x4000_4400, Part::Usart(1), Some((APB1, 17))),
    place("USART3", 0x4000_4800, Part::Usart(2), Some((APB1, 18))),
    place("CAN1", 0x4000_6400, Part::Can, Some((APB1, 25))),
    place("PWR", 0x4000_7000, Part::Pwr, Some((APB1, 28))),
    place("USART1", 0x4001_1000, Part::Usart(0), Some((APB2, 4))),
    place("USART6", 0x4001_1400, Part::Usart(3), Some((APB2, 5))),
    place("ADC1", 0x4001_2000, Part::Adc, Some((APB2, 8))),
    place("SPI1", 0x4001_3000, Part::Spi(0), Some((APB2, 12))),
    place("SYSCFG", 0x4001_3800, Part::Syscfg, Some((APB2, 14))),
    place("EXTI", 0x4001_3C00, Part::Exti, None),
    place("GPIOA", 0x4002_0000, Part::Gpio(0), Some((AHB1, 0))),
    place("GPIOB", 0x4002_0400, Part::Gpio(1), Some((AHB1, 1))),
    place("GPIOC", 0x4002_0800, Part::Gpio(2), Some((AHB1, 2))),
    place("GPIOD", 0x4002_0C00, Part::Gpio(3), Some((AHB1, 3))),
    place("GPIOE", 0x4002_1000, Part::Gpio(4), Some((AHB1, 4))),
    place("GPIOF", 0x4002_1400, Part::Gpio(5), Some((AHB1, 5))),
    place("GPIOG", 0x4002_1800, Part::Gpio(6), Some((AHB1, 6))),
    place("GPIOH", 0x4002_1C00, Part::Gpio(7), Some((AHB1, 7))),
    place("GPIOI", 0x4002_2000, Part::Gpio(8), Some((AHB1, 8))),
    place("RCC", 0x4002_3800, Part::Rcc, None),
    place("FLASH", 0x4002_3C00, Part::Flash, None),
    place("DMA1", 0x4002_6000, Part::Dma(0), Some((AHB1, 21))),
    place("DMA2", 0x4002_6400, Part::Dma(1), Some((AHB1, 22))),
];
