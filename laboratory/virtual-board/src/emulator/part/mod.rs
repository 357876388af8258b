//! The peripherals of an STM32F405, one file each, after the reference manual RM0090.

pub mod adc;
pub mod can;
pub mod dma;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod pwr;
pub mod rcc;
pub mod spi;
pub mod tim11;
pub mod timer;
pub mod usart;

/// A register that is not modelled.
pub(crate) fn unknown<T>(peripheral: &str, offset: u32) -> Result<T, String> {
    Err(format!("{peripheral} has no model of its register at offset {offset:#x}"))
}
