//! 160 MHz, from the crystal if it starts and has the right frequency, otherwise from the internal
//! oscillator. A crystal that is not the board's would set another frequency: 12 MHz instead of 8 would run the core
//! at 240 MHz.
//!
//! SYSCLK 160 MHz and not 168: APB2 is then 80 MHz and SPI1 runs at exactly 5.0 MHz, half of the sensor's limit;
//! the dividers of 84 MHz give 5.25 MHz.

use bootloader::crystal;
use embassy_stm32::Config;
use embassy_stm32::pac::{FLASH, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk,
};
use embassy_stm32::time::Hertz;

use crate::wiring::CRYSTAL_MHZ;

/// Internal oscillator, MHz.
const HSI_MHZ: u32 = crystal::HSI_MHZ;

/// Input of the PLL after its divider, MHz: 1 or 2 are allowed, and RM0090 recommends 2 to limit
/// jitter, which an odd crystal frequency excludes.
const PLL_INPUT_MHZ: u32 = if CRYSTAL_MHZ.is_multiple_of(2) { 2 } else { 1 };

/// Oscillator of the PLL, MHz; half of it is the system clock.
const PLL_MHZ: u32 = 320;

const _: () = assert!(
    4 <= CRYSTAL_MHZ && CRYSTAL_MHZ <= 26,
    "CRYSTAL_MHZ: the STM32F405 takes crystals of 4 to 26 MHz"
);

/// Source of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The crystal.
    Crystal,
    /// The internal oscillator, with the frequency of the crystal, kHz, which is 0 if it does not start. It is within 1 % at 25 °C, within 4 % from −10 to 85 °C (data sheet DS8626,
    /// HSI oscillator characteristics). Not accurate enough for CAN; the serial line tolerates some 4 % in all
    /// (RM0090, tolerance of the USART receiver).
    Internal(u32),
}

/// Starts the crystal and measures it. The HAL would wait for a missing one indefinitely.
pub fn start() -> Source {
    match crystal::start(CRYSTAL_MHZ) {
        Ok(()) => Source::Crystal,
        Err(khz) => Source::Internal(khz),
    }
}

/// The HAL's configuration for `source`.
pub fn config(source: Source) -> Config {
    let (pll_src, input_mhz) = match source {
        Source::Crystal => (PllSource::HSE, CRYSTAL_MHZ),
        Source::Internal(_) => (PllSource::HSI, HSI_MHZ),
    };
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = (source == Source::Crystal)
        .then_some(Hse { freq: Hertz::mhz(CRYSTAL_MHZ), mode: HseMode::Oscillator });
    rcc.pll_src = pll_src;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::from_bits((input_mhz / PLL_INPUT_MHZ) as u8),
        mul: PllMul::from_bits((PLL_MHZ / PLL_INPUT_MHZ) as u16),
        divp: Some(PllPDiv::DIV2),
        // Unused, but its reset value is lost and 0 is forbidden: 45.7 of at most 48 MHz.
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV4;
    rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

/// Makes the loss of the crystal an exception (NMI) instead of a silent halt.
pub fn watch_crystal() {
    RCC.cr().modify(|w| w.set_csson(true));
}

/// Enables the caches that hide the flash's five wait states. The HAL leaves them off.
pub fn enable_caches() {
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(true);
    });
}
